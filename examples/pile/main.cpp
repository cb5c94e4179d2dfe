#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <exception>
#include <map>
#include <string>

#include "presets.h"
#include "report.h"
#include "simulation.h"
#include "spaces.h"

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
    // Said by the debug build when two fine meshes touch in many points; the narrow phase keeps
    // only a few of them, so that near duplicates do no harm.
    if (std::strstr(text, "contact hash table") || std::strstr(text, "contach hash table")) return;
    if (++counts()[text] == 1) std::fprintf(stderr, "ODE: %s\n", text);
  }
};

// Steps until the end, a difference found by the check, or a body that is nowhere any more. Returns
// what the check found.
std::string runSteps(const Options& options, World& world, CsvFile& csv, Totals& totals,
                     MotionLog& log) {
  Simulation simulation(world, options);
  ProgressBar progress(options.steps);
  for (int i = 0; i < options.steps; ++i) {
    const Frame frame = simulation.step();
    const Motion motion = measure(world);
    totals.add(frame);
    log.add(motion, frame.deepest);
    csv.add(frame, motion);
    progress.show(frame, motion);
    if (simulation.difference())
      return "frame " + std::to_string(frame.number) + ": " + *simulation.difference();
    if (motion.not_finite) break;
  }
  return "";
}

int run(const Options& options) {
  CsvFile csv(options.csv);
  World world;
  Random random(options.seed);
  presetOf(options.scene).build(world, options.bodies, random);
  world.useSpace(createSpace(options, world.geoms()));
  printHeader(world, options);

  Totals totals;
  MotionLog log(measure(world));
  const std::string difference = runSteps(options, world, csv, totals, log);
  printTimes(totals, world);
  printMotion(log, world);

  int exit_code = 0;
  const auto complain = [&](const std::string& text) {
    std::fflush(stdout);
    std::fprintf(stderr, "pile: %s\n", text.c_str());
    exit_code = 1;
  };
  if (!difference.empty())
    complain(difference);
  else if (options.check)
    std::printf("Checked: the pairs of all %d frames are those of dHashSpace.\n", totals.frames);
  if (const std::string fault = log.fault(); !fault.empty()) complain(fault);
  if (!csv.finish()) complain("cannot write all of the file " + options.csv);
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
