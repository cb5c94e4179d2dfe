#include <chrono>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>

#include "report.h"
#include "scenes.h"
#include "simulation.h"
#include "spaces.h"
#include "view/view.h"

namespace pile {
namespace {

// Without what a debug build says, thousands of times, when two fine meshes touch in many points:
// the narrow phase keeps only a few of them, so that near duplicates do no harm.
void printMessage(int, const char* format, va_list arguments) {
  if (std::strstr(format, "contact hash table") || std::strstr(format, "contach hash table"))
    return;
  std::fputs("ODE: ", stderr);
  std::vfprintf(stderr, format, arguments);
  std::fputs("\n", stderr);
}

// A pile from the first step to the last.
class Run {
 public:
  explicit Run(const Options& options);

  // One more step. False after the last one, or a difference found by the check.
  bool step();

  // Prints what there is to say at the end and returns the exit code.
  int finish();

  Show show() {
    return {world_, *simulation_, [this] { return step(); }, [this] { return title(); }};
  }

 private:
  using Clock = std::chrono::steady_clock;

  void settle();
  void showProgress();
  void compare();
  std::string title() const;

  const Options& options_;
  CsvFile csv_;
  World world_;
  std::optional<Simulation> simulation_;
  Totals totals_;
  Frame frame_;
  Clock::time_point shown_ = Clock::now();
  std::string difference_;
};

Run::Run(const Options& options) : options_(options), csv_(options.csv) {
  Random random(options.seed);
  presetOf(options.scene).build(world_, options.bodies, random);
  printHeader(world_, options);
  if (options.settle) settle();
  world_.useSpace(createSpace(options));
  simulation_.emplace(world_, options);
}

// The steps before those that are measured are the same whatever these are to be.
void Run::settle() {
  Options options;
  options.scene = options_.scene;
  options.seed = options_.seed;
  options.threads = options_.threads;
  world_.useSpace(createSpace(options));
  Simulation simulation(world_, options);
  for (int step = 0; step < options_.settle; ++step) simulation.step();
}

bool Run::step() {
  if (totals_.frames == options_.steps || !difference_.empty()) return false;
  frame_ = simulation_->step();
  totals_.add(frame_);
  csv_.add(frame_, world_.state());
  if (simulation_->difference())
    difference_ = "frame " + std::to_string(frame_.number) + ": " + *simulation_->difference();
  if (!options_.view) showProgress();
  return true;
}

void Run::showProgress() {
  if (Clock::now() - shown_ < std::chrono::seconds(10)) return;
  shown_ = Clock::now();
  std::fprintf(stderr, "step %d of %d\n", frame_.number, options_.steps);
}

std::string Run::title() const {
  char line[128];
  std::snprintf(line, sizeof line, "pile: step %d, %.2f ms, broad phase %.2f; %zu of %zu asleep",
                frame_.number, frame_.totalMs(), frame_.broad_ms, world_.state().asleep,
                world_.bodies().size());
  return line;
}

int Run::finish() {
  int exit_code = 0;
  const auto complain = [&](const std::string& text) {
    std::fflush(stdout);
    std::fprintf(stderr, "pile: %s\n", text.c_str());
    exit_code = 1;
  };
  if (!csv_.finish()) complain("cannot write all of the file " + options_.csv);
  if (!totals_.frames) return exit_code;
  printTimes(totals_, world_, options_);
  if (!difference_.empty())
    complain(difference_);
  else if (options_.check)
    std::printf("Checked: the pairs of %s are those of dHashSpace.\n",
                counted(totals_.frames, "frame").c_str());
  if (options_.compare && exit_code == 0) {
    simulation_.reset();
    compare();
  }
  return exit_code;
}

// Goes on with the pile in dHashSpace, with the one line changed, and with parallel contacts.
void Run::compare() {
  std::printf("\nThe same pile, %s more\n  %-24s %10s  %14s  %s\n",
              counted(options_.compare, "step").c_str(), "space", "ms a step", "broad phase",
              "step, times faster than dHashSpace");
  double first = 0;
  const auto row = [&](const char* name, SpaceKind kind, bool parallel_narrow) {
    Options options = options_;
    options.space = kind;
    options.parallel_narrow = parallel_narrow;
    options.check = false;
    world_.useSpace(createSpace(options));
    Simulation simulation(world_, options);
    Totals totals;
    simulation.step();  // which takes all geoms in
    for (int i = 0; i < options.compare; ++i) totals.add(simulation.step());
    const double step = totals.totalMs() / totals.frames;
    if (first == 0) first = step;
    std::printf("  %-24s %10.3f  %14.3f  %.2f\n", name, step, totals.broad_ms / totals.frames,
                first / step);
  };
  row("dHashSpace", SpaceKind::Hash, false);
  row("the one line changed", SpaceKind::Parallel, false);
  row("parallel contacts", SpaceKind::Parallel, true);
}

int run(const Options& options) {
  Run run(options);
  bool draws = options.view || !options.snapshot.empty();
  std::string no_picture;
  try {
    if (draws) view(options, run.show());
  } catch (const UsageError& error) {
    if (!options.if_possible || options.view) throw;
    no_picture = error.what();
    draws = false;
  }
  while (!draws && run.step()) {
  }
  const int exit_code = run.finish();
  if (!no_picture.empty()) std::printf("No picture of the pile: %s\n", no_picture.c_str());
  return exit_code;
}

}  // namespace
}  // namespace pile

int main(int argc, char** argv) {
  dSetMessageHandler(pile::printMessage);
  try {
    const std::optional<pile::Options> options = pile::parseOptions(argc, argv);
    return options ? pile::run(*options) : 0;
  } catch (const pile::UsageError& error) {
    std::fprintf(stderr, "pile: %s\nTry pile --help.\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pile: %s\n", error.what());
    return 1;
  }
}
