// What each option of the space would give the program of a trace.
#pragma once

#include <string>
#include <vector>

#include "player.h"

namespace trace {

struct TableWishes {
  std::vector<int> threads;         // to be tried, ascending
  std::vector<double> tolerances;   // lengths
  std::vector<int> devices;         // GPUs
  std::vector<std::string> spaces;  // of ODE's, to compare with: hash, sap, simple
  int turns = 3;                    // how often the trace is played for a row
  int contacts = 8;                 // that dCollide may find of a pair
  bool collide = true;              // rows with dCollide
};

struct TableRow {
  std::string option;
  int threads = 1;
  double median_ms = 0, least_ms = 0;  // of a frame
  double pairs = 0, contacts = 0;      // a frame
  bool collides = false;               // dCollide for each pair is in the time
};

// The first row is the space as the program has set it, on one thread. Rows of what is not to be
// had here are left out.
std::vector<TableRow> measureOptions(const Recording& recording, const TableWishes& wishes);

// What the program had set in this frame.
void setAsTraced(dSpaceID space, const Frame& frame);

}  // namespace trace
