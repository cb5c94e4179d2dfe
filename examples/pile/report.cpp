#include "report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <limits>

#include "scenes.h"
#include "spaces.h"

namespace pile {
namespace {

std::string grouped(size_t number) {
  std::string digits = std::to_string(number);
  for (int i = static_cast<int>(digits.size()) - 3; i > 0; i -= 3)
    digits.insert(static_cast<size_t>(i), ",");
  return digits;
}

std::string grouped(double number) {
  return grouped(static_cast<size_t>(std::llround(number)));
}

void printRow(const char* name, double ms, double whole, int threads = 0) {
  std::printf("  %-24s %10.3f  %5.1f %%", name, ms, whole > 0 ? 100 * ms / whole : 0.0);
  if (threads) std::printf("  %7d", threads);
  std::puts("");
}

}  // namespace

CsvFile::CsvFile(const std::string& name) : name_(name) {
  if (name_.empty()) return;
  file_.open(name_);
  file_ << "frame,pairs,contacts,asleep,broad_ms,narrow_ms,joints_ms,solver_ms,height_m\n"
        << std::setprecision(17);
  file_.flush();
  if (!file_) throw UsageError("cannot write the file " + name_);
}

void CsvFile::add(const Frame& frame, const State& state) {
  if (name_.empty()) return;
  file_ << frame.number << ',' << frame.pairs << ',' << frame.contacts << ',' << state.asleep << ','
        << frame.broad_ms << ',' << frame.narrow_ms << ',' << frame.joints_ms << ','
        << frame.solver_ms << ',' << state.mean_height << '\n';
}

bool CsvFile::finish() {
  if (name_.empty()) return true;
  file_.close();
  return !file_.fail();
}

void Totals::add(const Frame& frame) {
  ++frames;
  pairs += static_cast<double>(frame.pairs);
  contacts += static_cast<double>(frame.contacts);
  broad_ms += frame.broad_ms;
  narrow_ms += frame.narrow_ms;
  joints_ms += frame.joints_ms;
  solver_ms += frame.solver_ms;
  broad_threads = std::max(broad_threads, frame.broad_threads);
  narrow_threads = std::max(narrow_threads, frame.narrow_threads);
  if (!frame.stages) return;
  if (!stages) stages.emplace(dParallelSAPStats{});
  stages->update_ms += frame.stages->update_ms;
  stages->extract_ms += frame.stages->extract_ms;
  stages->filter_ms += frame.stages->filter_ms;
  stages->report_ms += frame.stages->report_ms;
}

std::string counted(int number, const std::string& noun) {
  return std::to_string(number) + " " + noun + (number == 1 ? "" : "s");
}

void printHeader(const World& world, const Options& options) {
  std::printf("%s: %s %s", options.scene.c_str(), grouped(world.bodies().size()).c_str(),
              world.bodies().size() == 1 ? "body" : world.body_name.c_str());
  if (world.bodyTriangles()) std::printf(" (%s triangles)", grouped(world.bodyTriangles()).c_str());
  std::printf(" onto %s", world.ground_name.c_str());
  if (world.staticTriangles())
    std::printf(" (%s triangles)", grouped(world.staticTriangles()).c_str());
  std::printf(
      "\n%s of %g s, seed %u%s\n",
      options.steps == std::numeric_limits<int>::max() ? "Steps"
                                                       : counted(options.steps, "step").c_str(),
      presetOf(options.scene).dt, options.seed,
      options.settle ? (", after " + std::to_string(options.settle) + " to settle").c_str() : "");
  std::fflush(stdout);
}

void printTimes(const Totals& totals, const World& world, const Options& options) {
  const double n = totals.frames;
  const double step = totals.totalMs() / n;
  std::printf("\n  %-24s %10s  %7s  %7s\n", "part", "ms a step", "share", "threads");
  const auto row = [&](const char* name, double sum, int threads = 0) {
    printRow(name, sum / n, step, threads);
  };
  row("broad phase", totals.broad_ms, totals.broad_threads);
  if (totals.stages) {
    row("  update AABBs", totals.stages->update_ms);
    row("  extract pairs", totals.stages->extract_ms);
    row("  filter", totals.stages->filter_ms);
    row("  report", totals.stages->report_ms);
  }
  row("narrow phase", totals.narrow_ms, totals.narrow_threads);
  row("contact joints", totals.joints_ms, 1);
  row("solver", totals.solver_ms, 1);
  row("step", totals.totalMs());
  std::printf("\n%s\n", describeSpace(world.space()).c_str());
  std::printf("A mean step: %s geoms, %s pairs, %s contacts.\n",
              grouped(world.geoms().size()).c_str(), grouped(totals.pairs / n).c_str(),
              grouped(totals.contacts / n).c_str());
  std::printf("Narrow phase: %s.\n",
              options.parallel_narrow ? "dParallelSAPSpaceCollideContacts" : "dCollide in a loop");
  const State state = world.state();
  std::printf("At the end: %s of %s bodies asleep, %s below the ground, mean height %.2f m.\n",
              grouped(state.asleep).c_str(), grouped(world.bodies().size()).c_str(),
              grouped(state.lost).c_str(), state.mean_height);
}

}  // namespace pile
