#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "comparison.h"
#include "interrupt.h"
#include "presets.h"
#include "report.h"
#include "simulation.h"
#include "spaces.h"
#include "times_picture.h"
#include "view/view.h"

namespace pile {
namespace {

// Prints what ODE says once and counts the rest.
class OdeMessages {
 public:
  OdeMessages() { dSetMessageHandler(receive); }
  ~OdeMessages() {
    dSetMessageHandler(nullptr);
    for (const auto& [text, count] : counts())
      if (count > 1) std::fprintf(stderr, "ODE said %d times: %s\n", count, text.c_str());
  }
  OdeMessages(const OdeMessages&) = delete;
  OdeMessages& operator=(const OdeMessages&) = delete;

 private:
  static std::map<std::string, int>& counts() {
    static std::map<std::string, int> counts;
    return counts;
  }

  static void receive(int, const char* format, va_list arguments) {
    char text[512];
    std::vsnprintf(text, sizeof text, format, arguments);
    static std::mutex lock;  // colliders may speak from several threads
    const std::lock_guard<std::mutex> guard(lock);
    // Said by the debug build when two fine meshes touch in many points; the narrow phase keeps
    // only a few of them, so that near duplicates do no harm.
    if (std::strstr(text, "contact hash table") || std::strstr(text, "contach hash table")) return;
    if (++counts()[text] == 1) std::fprintf(stderr, "ODE: %s\n", text);
  }
};

// Enough for a heap to form, a fraction of what its scene has.
constexpr int settling_iterations = 8;

// A pile from the first step to the last.
class Run {
 public:
  explicit Run(const Options& options);

  // One more step. False after the last one, an interrupt, a difference found by the check, or a
  // body that is nowhere any more.
  bool step();

  // Every body gets up and is thrown outwards and upwards.
  void shove();

  // Prints what there is to say at the end and returns the exit code.
  int finish();

  World& world() { return world_; }
  const Simulation& simulation() const { return *simulation_; }
  const Frame& frame() const { return frame_; }
  const Motion& motion() const { return log_->last(); }

 private:
  void settle();

  const Options& options_;
  CsvFile csv_;
  World world_;
  std::optional<MotionLog> log_;
  std::optional<Simulation> simulation_;
  Totals totals_;
  Frame frame_;
  std::string difference_;
};

Run::Run(const Options& options) : options_(options), csv_(options.csv) {
  if (const std::string& file = options.times_picture;
      !file.empty() && !std::ofstream(file, std::ios::app))
    throw UsageError("cannot write the file " + file);
  world_.density = options.density;
  Random random(options.seed);
  presetOf(options.scene).build(world_, options.bodies, random);
  printHeader(world_, options);
  log_.emplace(measure(world_));
  if (options.settle) settle();
  if (options.random_bodies) world_.shuffleBodies(random);
  world_.useSpace(createSpace(options, world_.geoms()));
  simulation_.emplace(world_, options);
}

// The steps before those that are measured are the same whatever these are to be: found by the
// parallel space, solved by ODE in one thread.
void Run::settle() {
  Options options = options_;
  options.space = SpaceKind::Parallel;
  options.method = options.backend = std::nullopt;
  options.rules = {};
  options.erp = Options().erp;
  options.cfm = Options().cfm;
  options.parallel_narrow = true;
  options.parallel_stepping = options.random_contacts = options.check = false;
  options.reducer = Reducer::Farthest;
  options.contacts = presetOf(options.scene).contacts;
  options.iterations = settling_iterations;
  world_.useSpace(createSpace(options, world_.geoms()));
  Simulation simulation(world_, options);
  for (int step = 0; step < options.settle && !Interrupt::signal(); ++step) simulation.step();
  log_->allow(measure(world_));
}

bool Run::step() {
  if (totals_.frames == options_.steps || Interrupt::signal() || !difference_.empty() ||
      log_->last().not_finite)
    return false;
  frame_ = simulation_->step();
  const Motion motion = measure(world_);
  totals_.add(frame_);
  log_->add(motion, frame_.deepest);
  csv_.add(frame_, motion);
  if (simulation_->difference())
    difference_ = "frame " + std::to_string(frame_.number) + ": " + *simulation_->difference();
  return true;
}

void Run::shove() {
  constexpr double outwards = 3;  // metres a second
  constexpr double upwards = 4;
  for (dBodyID body : world_.bodies()) {
    const dReal* place = dBodyGetPosition(body);
    const dReal* speed = dBodyGetLinearVel(body);
    const double distance = std::hypot(place[0], place[1]) + world_.body_size;
    dBodyEnable(body);
    dBodySetLinearVel(body, static_cast<dReal>(speed[0] + outwards * place[0] / distance),
                      static_cast<dReal>(speed[1] + outwards * place[1] / distance),
                      static_cast<dReal>(speed[2] + upwards));
  }
  log_->allow(measure(world_));
}

int Run::finish() {
  std::vector<Way> ways;
  if (totals_.frames) {
    printTimes(totals_, world_, options_);
    printMotion(*log_, world_);
    if (options_.compare && !Interrupt::signal() && log_->fault().empty()) {
      simulation_.reset();
      ways = compareWays(world_, options_);
      printWays(ways, options_.compare);
    }
  }
  int exit_code = 0;
  if (const int signal = Interrupt::signal()) {
    std::printf("Interrupted after %s.\n", counted(totals_.frames, "step").c_str());
    exit_code = 128 + signal;  // as shells have it
  }
  const auto complain = [&](const std::string& text) {
    std::fflush(stdout);
    std::fprintf(stderr, "pile: %s\n", text.c_str());
    exit_code = 1;
  };
  if (!difference_.empty())
    complain(difference_);
  else if (options_.check && totals_.frames)
    std::printf("Checked: the pairs of %s are those of dHashSpace.\n",
                counted(totals_.frames, "frame").c_str());
  if (const std::string fault = log_->fault(); !fault.empty()) complain(fault);
  if (!csv_.finish()) complain("cannot write all of the file " + options_.csv);
  if (const std::string& file = options_.times_picture; !file.empty() && totals_.frames) {
    if (writeTimesPicture(totals_, ways, world_, options_, file))
      std::printf("Picture %s: where the time of a step went\n", file.c_str());
    else
      complain("cannot write all of the file " + file);
  }
  return exit_code;
}

// The viewer, if one is needed. One that would only be welcome may be missing: then `reason` says
// why.
std::unique_ptr<Viewer> viewerFor(const Options& options, std::string& reason) {
  if (!options.view && options.snapshot.empty()) return nullptr;
  try {
    return createViewer(options);
  } catch (const UsageError& error) {
    if (!options.snapshot_if_possible) throw;
    reason = error.what();
    return nullptr;
  }
}

int run(const Options& options) {
  const Interrupt interrupt;
  std::string no_picture;
  const std::unique_ptr<Viewer> viewer = viewerFor(options, no_picture);
  Run run(options);
  {
    std::optional<ProgressBar> progress;
    if (!options.view) progress.emplace(options.steps);
    const auto step = [&] {
      const bool more = run.step();
      if (progress) progress->show(run.frame(), run.motion());
      return more;
    };
    if (viewer)
      viewer->run({run.world(), run.simulation(), step,
                   [&] { return timesLine(run.frame(), run.motion()); }, [&] { run.shove(); }});
    else
      while (step()) {
      }
  }
  const int exit_code = run.finish();
  if (!no_picture.empty()) std::printf("No picture of the pile: %s\n", no_picture.c_str());
  return exit_code;
}

}  // namespace
}  // namespace pile

int main(int argc, char** argv) {
  const pile::OdeMessages messages;
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
