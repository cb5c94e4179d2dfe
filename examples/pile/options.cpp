#include "options.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <limits>
#include <vector>

#include "scenes.h"

namespace pile {
const Names method_names = {{"auto", dParallelSAPMethodAuto},
                            {"sweep", dParallelSAPMethodSweep},
                            {"brute-force", dParallelSAPMethodBruteForce},
                            {"axis-lists", dParallelSAPMethodAxisLists}};
const Names backend_names = {{"auto", dParallelSAPBackendAuto},
                             {"cpu", dParallelSAPBackendCPU},
                             {"cuda", dParallelSAPBackendCUDA}};

namespace {

const Names space_names = {{"parallel", int(SpaceKind::Parallel)},
                           {"hash", int(SpaceKind::Hash)},
                           {"sap", int(SpaceKind::SweepAndPrune)},
                           {"simple", int(SpaceKind::Simple)}};

// dHashSpace numbers the cells of an n x n bit table with an int, 8 cells a number.
constexpr int hash_space_limit = 131071;
constexpr int most_bodies = 10000000;

constexpr const char* about =
    R"(Drops a pile of rigid bodies and shows where the time of a step goes.

A step is four parts, timed apart: the broad phase, the narrow phase (in the parallel space one
call does both, dParallelSAPSpaceCollideContacts; in others a callback of dSpaceCollide queues the
pairs, and a loop calls dCollide for each), the contact joints, the solver (dWorldQuickStep).)";

std::string scenesHelp() {
  std::string text =
      "Exit codes: 1 the check found a difference, or a file could not be written; 2 the\n"
      "options cannot be met.\n\nScenes:\n";
  for (const Preset& preset : presets())
    text += std::string("  ") + preset.name +
            std::string(10 - std::string(preset.name).size(), ' ') + preset.about + "\n";
  return text;
}

std::vector<std::string> keys(const Names& names) {
  std::vector<std::string> all;
  for (const auto& name : names) all.push_back(name.first);
  return all;
}

// The words of the command line that stand for something else.
struct Words {
  std::string space = "parallel", method, backend, narrow;
};

void addRunOptions(CLI::App& app, Options& options) {
  std::vector<std::string> scenes;
  for (const Preset& preset : presets()) scenes.push_back(preset.name);
  app.add_option("--scene", options.scene, "What to drop, and onto what")
      ->check(CLI::IsMember(scenes))
      ->capture_default_str();
  const std::string of_scene = " (default: the scene's)";
  constexpr int most = std::numeric_limits<int>::max();
  app.add_option("--bodies", options.bodies, "Number of bodies" + of_scene)
      ->check(CLI::Range(1, most_bodies));
  app.add_option("--steps", options.steps, "Number of time steps" + of_scene)
      ->check(CLI::Range(1, most));
  app.add_option("--settle", options.settle,
                 "Steps before those that are measured, in the parallel space whatever is measured")
      ->check(CLI::Range(0, most))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "Seed of the bodies' places, sizes and rotations")
      ->check(CLI::Range(0, most))
      ->capture_default_str();
  app.add_flag("--check", options.check,
               "Compare every frame's pairs with those of dHashSpace (not timed)");
  app.add_option("--compare", options.compare,
                 "Steps more at the end in dHashSpace, and as many with the one line changed and "
                 "with parallel contacts (from the parallel space only)")
      ->check(CLI::Range(0, most));
  app.add_option("--csv", options.csv, "Write one row a frame to this file");
  app.add_flag("--view", options.view,
               "Show the pile in a window, until it is closed or --steps are done");
  app.add_option("--snapshot", options.snapshot,
                 "Draw the end into this PNG file; without --view no display is needed");
  app.add_flag("--if-possible", options.if_possible,
               "Go on without the snapshot where there is nothing to draw it with");
}

void addSpaceOptions(CLI::App& app, Words& words, Options& options) {
  app.add_option("--space", words.space,
                 "The broad phase: parallel is dParallelSAPSpace, the others are ODE's")
      ->check(CLI::IsMember(keys(space_names)))
      ->capture_default_str();
  const std::string only = " (parallel space only)";
  app.add_option("--threads", options.threads, "Threads, 0: as many as may be used" + only)
      ->check(CLI::Range(0, 256));
  app.add_option("--method", words.method, "How pairs are found" + only)
      ->check(CLI::IsMember(keys(method_names)));
  app.add_option("--backend", words.backend, "Where pairs are found" + only)
      ->check(CLI::IsMember(keys(backend_names)));
  app.add_option("--narrow", words.narrow,
                 "The narrow phase: dCollide in a loop, or on the threads of the parallel space "
                 "(default: parallel in that space; the others have only the loop)")
      ->check(CLI::IsMember({"serial", "parallel"}));
}

void takeSpaceOptions(const Words& words, Options& options) {
  options.space = static_cast<SpaceKind>(space_names.at(words.space));
  if (!words.method.empty()) options.method = method_names.at(words.method);
  if (!words.backend.empty()) options.backend = backend_names.at(words.backend);
  const bool ours = options.space == SpaceKind::Parallel;
  options.parallel_narrow = words.narrow.empty() ? ours : words.narrow == "parallel";
  const bool wants_ours = options.threads || options.method || options.backend ||
                          options.parallel_narrow || options.compare;
  if (!ours && wants_ours)
    throw UsageError(
        "--threads, --method, --backend, --narrow parallel and --compare need --space parallel");
}

void checkLimits(const CLI::App& app, const Options& options) {
  const std::string& file = options.snapshot;
  if (app.count("--snapshot") && (file.size() < 4 || file.substr(file.size() - 4) != ".png"))
    throw UsageError("--snapshot: " + file + " does not end with .png, and pictures are PNG files");
  const bool uses_hash = options.check || options.compare || options.space == SpaceKind::Hash;
  if (uses_hash && options.bodies + most_static_geoms > hash_space_limit)
    throw UsageError("dHashSpace, and so --check and --compare, takes at most " +
                     std::to_string(hash_space_limit - most_static_geoms) + " bodies");
}

}  // namespace

std::optional<Options> parseOptions(int argc, char** argv) {
  CLI::App app{about, "pile"};
  app.footer(scenesHelp());
  Options options;
  Words words;
  addRunOptions(app, options);
  addSpaceOptions(app, words, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help();
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    throw UsageError(error.what());
  }
  takeSpaceOptions(words, options);
  const Preset& preset = presetOf(options.scene);
  if (!options.bodies) options.bodies = preset.bodies;
  if (!options.steps) options.steps = options.view ? std::numeric_limits<int>::max() : preset.steps;
  checkLimits(app, options);
  return options;
}

}  // namespace pile
