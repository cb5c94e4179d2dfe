#ifndef PILE_REPORT_H
#define PILE_REPORT_H

#include <fstream>
#include <string>

#include "simulation.h"

namespace pile {

// One row a frame; the columns are explained in the examples' README.
class CsvFile {
 public:
  // No name, no file. Throws UsageError if the file cannot be written.
  explicit CsvFile(const std::string& name);
  void add(const Frame& frame, const State& state);
  // False if something could not be written.
  bool finish();

 private:
  std::string name_;
  std::ofstream file_;
};

// Sums of a run.
struct Totals {
  int frames = 0;
  double pairs = 0;
  double contacts = 0;
  double broad_ms = 0;
  double narrow_ms = 0;
  double joints_ms = 0;
  double solver_ms = 0;
  int broad_threads = 1;  // the most of a step
  int narrow_threads = 1;
  std::optional<dParallelSAPStats> stages;  // the five stage times are sums

  void add(const Frame& frame);
  double totalMs() const { return broad_ms + narrow_ms + joints_ms + solver_ms; }
};

// "1 step", "2 steps".
std::string counted(int number, const std::string& noun);

void printHeader(const World& world, const Options& options);
void printTimes(const Totals& totals, const World& world, const Options& options);

}  // namespace pile

#endif
