// What each option of the space would give the program of a trace.
#pragma once

#include <string>
#include <vector>

#include "replay_timing.h"

namespace trace {

struct TableWishes {
  std::vector<int> threads;         // to be tried, ascending
  std::vector<double> tolerances;   // lengths
  std::vector<int> devices;         // GPUs
  std::vector<std::string> spaces;  // of ODE's, to compare with
  int turns = 3;                    // how often the trace is played for a row
  int contacts = 8;                 // of a pair at most; 0: no rows with dCollide
};

struct TableRow {
  std::string option;
  Setting setting;
  Timing timing;
};

// The first row is the space as the program has set it, on the first number of threads. Rows of
// what is not to be had here are left out.
std::vector<TableRow> measureOptions(const Recording& recording, const TableWishes& wishes);

// The row against which one is to be held: the first that does the same work.
const TableRow& baseOf(const std::vector<TableRow>& rows, const TableRow& row);

}  // namespace trace
