// What was found out about extremes, as rows of a CSV file that grows by one at a time: whoever is
// interrupted goes on where it was.
#pragma once

#include <string>
#include <vector>

#include "rescue.h"

namespace sap_test {
namespace physics {

struct Row {
  std::string theme, extreme;
  std::string simple, hash, ours;  // outcomes, and at which step of those that come to an end there
  bool same = false;               // bit for bit, of the first and the last
  Measures measures;               // of the last
  std::string rescue;              // empty where none is needed
  double cost = 0;                 // of the rescue; 0: none
};

extern const char* const kPrecision;  // double or single
extern const char* const kNotLookedFor;
extern const char* const kNone;

// "aborts at step 7", "stands".
std::string shown(const Result& result);

// The file's; none where there is no file. Throws std::runtime_error where it has other columns or
// is of the other precision. A last line that was cut short is no row.
std::vector<Row> readRows(const std::string& file);
// Adds one, with the line of names if it is the first.
void addRow(const std::string& file, const Row& row);
// All of them, in the order of extremes().
void writeRows(const std::string& file, std::vector<Row> rows);

}  // namespace physics
}  // namespace sap_test
