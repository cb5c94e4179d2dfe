#ifndef TRADEOFF_TRACE_POINT_H
#define TRADEOFF_TRACE_POINT_H

#include <string>

#include "row.h"

namespace tradeoff {

// The frames of another program, which dParallelSAPSpaceSetTrace wrote.
struct TraceSettings {
  std::string file;
  std::string space = "parallel";  // or "hash", "sap"
  std::string work = "pairs";    // are counted; "loop": dCollide for each; "contacts": in parallel
  std::string skip = "nothing";  // or "static", "asleep", "planes", "all"
  int threads = 1;
  int devices = 0;       // GPUs; 0: the CPU
  double tolerance = 0;  // as a share of the usual size of a geom
  int contacts = 8;      // of a pair at most
  int turns = 3;         // how often the trace is played
};

// Measures a frame, as a median. Throws std::runtime_error where the file is no whole trace, or a
// GPU is not to be had.
Row measureTrace(const TraceSettings& settings);

}  // namespace tradeoff

#endif
