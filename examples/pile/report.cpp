#include "report.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <limits>

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

void printStages(const dParallelSAPStats& sums, double frames, double step) {
  printRow("  update AABBs", sums.update_ms / frames, step);
  printRow("  synchronise", sums.synchronise_ms / frames, step);
  printRow("  extract pairs", sums.extract_ms / frames, step);
  printRow("  filter", sums.filter_ms / frames, step);
  printRow("  report", sums.report_ms / frames, step);
}

}  // namespace

CsvFile::CsvFile(const std::string& name) : name_(name) {
  if (name_.empty()) return;
  file_.open(name_);
  file_
      << "frame,time_s,geoms,pairs,contacts,asleep,update_ms,synchronise_ms,extract_ms,filter_ms,"
         "report_ms,broad_ms,narrow_ms,joints_ms,solver_ms,step_ms,deepest_m,fastest_m_s,energy\n";
  file_.flush();
  if (!file_) throw UsageError("cannot write the file " + name_);
}

void CsvFile::add(const Frame& frame, const Motion& motion) {
  if (name_.empty()) return;
  file_ << frame.number << ',' << frame.time << ',' << frame.geoms << ',' << frame.pairs << ','
        << frame.contacts << ',' << motion.asleep << ',';
  if (frame.stages) {
    const dParallelSAPStats& s = *frame.stages;
    file_ << s.update_ms << ',' << s.synchronise_ms << ',' << s.extract_ms << ',' << s.filter_ms
          << ',' << s.report_ms << ',';
  } else {
    file_ << ",,,,,";
  }
  file_ << frame.broad_ms << ',' << frame.narrow_ms << ',' << frame.joints_ms << ','
        << frame.solver_ms << ',' << frame.totalMs() << ',' << std::setprecision(17)
        << frame.deepest << ',' << motion.fastest << ',' << motion.energy << std::setprecision(6)
        << '\n';
}

bool CsvFile::finish() {
  if (name_.empty()) return true;
  file_.close();
  return !file_.fail();
}

ProgressBar::ProgressBar(int steps) : ProgressBar(steps, stderr, std::chrono::seconds(10)) {
  on_terminal_ = isatty(STDERR_FILENO) != 0;
  if (on_terminal_) between_ = std::chrono::milliseconds(100);
}

ProgressBar::ProgressBar(int steps, std::FILE* file, std::chrono::milliseconds between)
    : file_(file),
      on_terminal_(false),
      between_(between),
      steps_(steps),
      start_(Clock::now()),
      shown_(start_) {}

ProgressBar::~ProgressBar() {
  if (on_terminal_) std::fputs("\r\033[K", file_);
}

void ProgressBar::show(const Frame& frame, const Motion& motion) {
  const Clock::time_point now = Clock::now();
  if (now - shown_ < between_) return;
  shown_ = now;
  constexpr int width = 30;
  const int filled = static_cast<int>(static_cast<long long>(width) * frame.number / steps_);
  const double passed = std::chrono::duration<double>(now - start_).count();
  if (on_terminal_)
    std::fprintf(file_, "\r[%s%s] ", std::string(static_cast<size_t>(filled), '#').c_str(),
                 std::string(static_cast<size_t>(width - filled), '.').c_str());
  std::fprintf(file_, "step %d of %d, %zu asleep, %.0f s left%s", frame.number, steps_,
               motion.asleep, passed / frame.number * (steps_ - frame.number),
               on_terminal_ ? " \033[K" : "\n");
}

void Totals::add(const Frame& frame) {
  ++frames;
  simulated = frame.time;
  geoms += static_cast<double>(frame.geoms);
  pairs += static_cast<double>(frame.pairs);
  contacts += static_cast<double>(frame.contacts);
  broad_ms += frame.broad_ms;
  narrow_ms += frame.narrow_ms;
  joints_ms += frame.joints_ms;
  solver_ms += frame.solver_ms;
  threads.broad = std::max(threads.broad, frame.threads.broad);
  threads.narrow = std::max(threads.narrow, frame.threads.narrow);
  threads.solver = std::max(threads.solver, frame.threads.solver);
  if (!frame.stages) return;
  if (!stages) stages.emplace(dParallelSAPStats{});
  stages->update_ms += frame.stages->update_ms;
  stages->synchronise_ms += frame.stages->synchronise_ms;
  stages->extract_ms += frame.stages->extract_ms;
  stages->filter_ms += frame.stages->filter_ms;
  stages->report_ms += frame.stages->report_ms;
  stages->total_ms += frame.stages->total_ms;
}

std::vector<Part> Totals::parts() const {
  const double n = std::max(frames, 1);
  return {{"broad phase", broad_ms / n, threads.broad},
          {"narrow phase", narrow_ms / n, threads.narrow},
          {"contact joints", joints_ms / n, threads.joints},
          {"solver", solver_ms / n, threads.solver}};
}

std::string timesLine(const Frame& frame, const Motion& motion) {
  char stages[128] = "";
  if (frame.stages) {
    const dParallelSAPStats& s = *frame.stages;
    std::snprintf(stages, sizeof stages,
                  " (update %.2f, synchronise %.2f, extract %.2f, filter %.2f, report %.2f)",
                  s.update_ms, s.synchronise_ms, s.extract_ms, s.filter_ms, s.report_ms);
  }
  char line[384];
  std::snprintf(
      line, sizeof line,
      "pile: step %d, %.2f ms: broad phase %.2f%s, narrow phase %.2f, joints %.2f, solver "
      "%.2f; %zu of %zu asleep",
      frame.number, frame.totalMs(), frame.broad_ms, stages, frame.narrow_ms, frame.joints_ms,
      frame.solver_ms, motion.asleep, motion.bodies);
  return line;
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
      "\n%s of %g s, seed %llu%s\n",
      options.steps == std::numeric_limits<int>::max() ? "Steps"
                                                       : counted(options.steps, "step").c_str(),
      options.dt, static_cast<unsigned long long>(options.seed),
      options.settle ? (", after " + std::to_string(options.settle) + " to settle").c_str() : "");
  std::fflush(stdout);
}

void printTimes(const Totals& totals, const World& world, const Options& options) {
  const double n = totals.frames;
  const double step = totals.totalMs() / n;
  std::printf("\n  %-24s %10s  %7s  %7s\n", "part", "ms a step", "share", "threads");
  for (const Part& part : totals.parts()) {
    printRow(part.name, part.ms, step, part.threads);
    if (part.name == std::string("broad phase") && totals.stages)
      printStages(*totals.stages, n, step);
  }
  printRow("step", step, step);
  std::printf("\n%s\n", describeSpace(world.space()).c_str());
  std::printf("A mean step: %s geoms, %s pairs, %s contacts. %.2f s simulated in %.1f s.\n",
              grouped(totals.geoms / n).c_str(), grouped(totals.pairs / n).c_str(),
              grouped(totals.contacts / n).c_str(), totals.simulated, step * n / 1000);
  if (options.parallel_narrow)
    std::puts("Narrow phase: dParallelSAPSpaceCollideContacts.");
  else
    std::printf("Narrow phase: dCollide in a loop%s.\n",
                totals.stages ? "" : ", as ODE's own spaces have no other");
}

void printMotion(const MotionLog& log, const World& world) {
  const Motion& last = log.last();
  const Motion& start = log.start();
  std::printf(
      "At the end: %s of %s bodies asleep, %zu fell out of the world, energy %.1f %% of the "
      "start's.\n",
      grouped(last.asleep).c_str(), grouped(last.bodies).c_str(), last.fallen,
      100 * last.energy / start.energy);
  std::printf("Fastest body %.2f m/s (%.2f ever), centres between %.2f and %.2f m.\n", last.fastest,
              log.fastestEver(), last.lowest, last.highest);
  std::printf("Deepest contact %.1f mm (%.1f ever), bodies are about %.0f mm.\n",
              1000 * log.deepestNow(), 1000 * log.deepestEver(), 1000 * world.body_size);
}

}  // namespace pile
