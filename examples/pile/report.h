#ifndef PILE_REPORT_H
#define PILE_REPORT_H

#include <chrono>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "motion.h"
#include "simulation.h"

namespace pile {

// One row a frame; the columns are explained in the examples' README.
class CsvFile {
 public:
  // No name, no file. Throws UsageError if the file cannot be written.
  explicit CsvFile(const std::string& name);
  void add(const Frame& frame, const Motion& motion);
  // False if something could not be written.
  bool finish();

 private:
  std::string name_;
  std::ofstream file_;
};

// On standard error while the run lasts: a bar if that is a terminal, else a line each ten seconds.
class ProgressBar {
 public:
  explicit ProgressBar(int steps);
  // Of a file that is no terminal.
  ProgressBar(int steps, std::FILE* file, std::chrono::milliseconds between);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void show(const Frame& frame, const Motion& motion);

 private:
  using Clock = std::chrono::steady_clock;
  std::FILE* file_;
  bool on_terminal_;
  std::chrono::milliseconds between_;
  int steps_;
  Clock::time_point start_;
  Clock::time_point shown_;
};

// A part of the mean step.
struct Part {
  const char* name;
  double ms;
  int threads;  // the most of a step
};

// Sums of a run.
struct Totals {
  int frames = 0;
  double simulated = 0;  // seconds
  double geoms = 0;
  double pairs = 0;
  double contacts = 0;
  double broad_ms = 0;
  double narrow_ms = 0;
  double joints_ms = 0;
  double solver_ms = 0;
  PartThreads threads;                      // the most of a step
  std::optional<dParallelSAPStats> stages;  // the five stage times and total_ms are sums

  void add(const Frame& frame);
  double totalMs() const { return broad_ms + narrow_ms + joints_ms + solver_ms; }
  std::vector<Part> parts() const;  // in the order in which they run
};

// A frame's times and the bodies asleep, in one line.
std::string timesLine(const Frame& frame, const Motion& motion);

// "1 step", "2 steps".
std::string counted(int number, const std::string& noun);

void printHeader(const World& world, const Options& options);
void printTimes(const Totals& totals, const World& world, const Options& options);
void printMotion(const MotionLog& log, const World& world);

}  // namespace pile

#endif
