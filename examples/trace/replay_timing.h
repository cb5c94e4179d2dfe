// How long the frames of a trace take with one setting of a space.
#pragma once

#include <string>

#include "player.h"

namespace trace {

enum class Work {
  pairs,    // are counted
  loop,     // dCollide in the near callback
  contacts  // dParallelSAPSpaceCollideContacts
};

// Beyond what the program had set.
struct Setting {
  std::string space = "parallel";  // or "hash", "sap", "simple", of ODE's
  int threads = 1;                 // these and those below are of the parallel space
  int devices = 0;                 // GPUs; 0: the CPU
  bool skip_static = false, skip_asleep = false, cull_planes = false;
  double tolerance = 0;  // a length; 0: what the program had set
  Work work = Work::pairs;
  int contacts = 8;  // of a pair at most
  int turns = 3;     // how often the trace is played
};

struct Timing {
  double median_ms = 0, least_ms = 0;  // of a frame
  double pairs = 0, contacts = 0;      // a frame
};

// Plays the trace; moving the geoms is not in the times, nor is the first frame of each turn, in
// which all are new. Throws BadTrace, or std::runtime_error where there is no GPU.
Timing measure(const Recording& recording, const Setting& setting);

}  // namespace trace
