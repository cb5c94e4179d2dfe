#include "options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <map>
#include <sstream>
#include <vector>

#include "presets.h"

namespace pile {
namespace {

const std::map<std::string, SpaceKind> space_names = {{"parallel", SpaceKind::Parallel},
                                                      {"hash", SpaceKind::Hash},
                                                      {"sap", SpaceKind::SweepAndPrune},
                                                      {"quadtree", SpaceKind::QuadTree},
                                                      {"simple", SpaceKind::Simple}};
const std::map<std::string, int> method_names = {{"auto", dParallelSAPMethodAuto},
                                                 {"sweep", dParallelSAPMethodSweep},
                                                 {"brute-force", dParallelSAPMethodBruteForce},
                                                 {"axis-lists", dParallelSAPMethodAxisLists}};
const std::map<std::string, int> backend_names = {{"auto", dParallelSAPBackendAuto},
                                                  {"cpu", dParallelSAPBackendCPU},
                                                  {"cuda", dParallelSAPBackendCUDA}};

const std::map<std::string, Reducer> reducer_names = {
    {"farthest", Reducer::Farthest}, {"deepest", Reducer::Deepest}, {"spread", Reducer::Spread}};

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
      "Exit codes: 0 all is well; 1 the check found a difference, the pile went wrong or a\n"
      "file could not be written; 2 the options cannot be met; 130 and 143 Ctrl-C (SIGINT)\n"
      "and SIGTERM, which end the run after its step.\n\nScenes:\n";
  for (const Preset& preset : presets())
    text += std::string("  ") + preset.name +
            std::string(10 - std::string(preset.name).size(), ' ') + preset.about + "\n";
  return text;
}

template <typename Map>
std::vector<std::string> keys(const Map& map) {
  std::vector<std::string> names;
  for (const auto& entry : map) names.push_back(entry.first);
  return names;
}

// The words of the command line that stand for something else.
struct Names {
  std::string space = "parallel";
  std::string method;
  std::string backend;
  std::string narrow;  // empty: as the space allows
  std::string stepping = "serial";
  std::string creation_order = "place";
  std::string contact_order = "pairs";
  std::string reduce = "farthest";
  std::string sleep = "on";
  std::string pictures;
  int threads = 0;
};

// CLI::Range takes "nan" for a number in its range.
CLI::Validator numberIn(double least, double most) {
  const auto text = [](double number) {
    std::ostringstream out;
    out << number;
    return out.str();
  };
  const std::string low = text(least), high = text(most);
  const auto fault = [=](const std::string& given) {
    double number = 0;
    const bool valid =
        CLI::detail::lexical_cast(given, number) && number >= least && number <= most;
    return valid ? "" : "Value " + given + " not in range " + low + " to " + high;
  };
  return {fault, "FLOAT in [" + low + " - " + high + "]"};
}

// CLI11 reads "-1" as the largest unsigned number, and nothing as 0.
std::string seedFault(const std::string& text) {
  if (text.empty()) return "Value is empty";
  return text.front() == '-' ? "Value " + text + " is negative" : "";
}

void addRunOptions(CLI::App& app, Options& options) {
  std::vector<std::string> scenes;
  for (const Preset& preset : presets()) scenes.push_back(preset.name);
  app.add_option("--scene", options.scene, "What to drop, and onto what")
      ->check(CLI::IsMember(scenes))
      ->capture_default_str();
  const std::string of_scene = " (default: the scene's)";
  const CLI::Range count(1, std::numeric_limits<int>::max());
  app.add_option("--bodies", options.bodies, "Number of bodies" + of_scene)
      ->check(CLI::Range(1, most_bodies));
  app.add_option("--steps", options.steps, "Number of time steps" + of_scene)->check(count);
  app.add_option("--dt", options.dt, "Time step in seconds, up to 0.1" + of_scene)
      ->check(numberIn(1e-6, 0.1));
  app.add_option("--iterations", options.iterations, "Iterations of QuickStep" + of_scene)
      ->check(count);
  app.add_option("--erp", options.erp, "The part of a contact's depth that a step corrects")
      ->check(numberIn(0, 1))
      ->capture_default_str();
  app.add_option("--cfm", options.cfm, "How far contacts give under force, in s/kg")
      ->check(numberIn(0, 1000))
      ->capture_default_str();
  app.add_option("--density", options.density, "Of the bodies, in kg/m^3")
      ->check(numberIn(0.001, 100000))
      ->capture_default_str();
  app.add_option("--contacts", options.contacts, "Most contacts of a pair" + of_scene)
      ->check(CLI::Range(1, 64));
  app.add_option("--seed", options.seed, "Seed of the bodies' places, sizes and rotations")
      ->check(CLI::Validator(seedFault, "UINT"))
      ->capture_default_str();
  app.add_flag("--check", options.check,
               "Compare every frame's pairs with those of dHashSpace (not timed)");
  app.add_option("--compare", options.compare,
                 "Steps more at the end in dHashSpace, and as many with the one line changed and "
                 "with parallel contacts (from the parallel space only)")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  app.add_option("--csv", options.csv, "Write one row a frame to this file");
}

// What a program can do for the solver.
void addSolverOptions(CLI::App& app, Names& names, Options& options) {
  app.add_option("--settle", options.settle,
                 "Steps before those that are shown and measured, quick ones in the parallel space")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  app.add_option("--creation-order", names.creation_order,
                 "The order in which bodies and geoms are created")
      ->check(CLI::IsMember({"place", "random"}))
      ->capture_default_str();
  app.add_option("--contact-order", names.contact_order,
                 "The order in which contact joints are created: that of the pairs, or shuffled")
      ->check(CLI::IsMember({"pairs", "random"}))
      ->capture_default_str();
  app.add_option("--reduce", names.reduce,
                 "Which of too many contacts are kept: those far from each other, the deepest "
                 "(dParallelSAPKeepDeepest), those of the largest area (dParallelSAPKeepSpread)")
      ->check(CLI::IsMember(keys(reducer_names)))
      ->capture_default_str();
  app.add_option("--sleep", names.sleep, "Whether ODE disables bodies at rest")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
}

void addRules(CLI::App& app, Rules& rules) {
  const std::string only = " (parallel space only)";
  app.add_option("--tolerance", rules.tolerance,
                 "How far apart, in metres, pairs may be that are reported all the same" + only)
      ->check(numberIn(0, 1000))
      ->capture_default_str();
  app.add_flag("--skip-static", rules.skip_static, "Find no pairs of static geoms" + only);
  app.add_flag("--skip-asleep", rules.skip_asleep, "Find no pairs whose bodies all sleep" + only);
  app.add_flag("--cull-planes", rules.cull_planes,
               "Find no pairs of a plane with what is clear of it" + only);
}

void addSpaceOptions(CLI::App& app, Names& names) {
  app.add_option("--space", names.space,
                 "The broad phase: parallel is dParallelSAPSpace, the others are ODE's")
      ->check(CLI::IsMember(keys(space_names)))
      ->capture_default_str();
  const std::string only = " (parallel space only)";
  app.add_option("--threads", names.threads,
                 "Threads of the space and of parallel stepping, 0: as many as may be used")
      ->check(CLI::Range(0, 256));
  app.add_option("--method", names.method, "How pairs are found" + only)
      ->check(CLI::IsMember(keys(method_names)));
  app.add_option("--narrow", names.narrow,
                 "The narrow phase: dCollide in a loop, or on the threads of the parallel space "
                 "(default: parallel in that space; the others have only the loop)")
      ->check(CLI::IsMember({"serial", "parallel"}));
  app.add_option("--stepping", names.stepping,
                 "dWorldQuickStep: on one thread, or on threads of ODE's own")
      ->check(CLI::IsMember({"serial", "parallel"}))
      ->capture_default_str();
  app.add_option("--backend", names.backend, "Where pairs are found" + only)
      ->check(CLI::IsMember(keys(backend_names)));
}

// drawstuff's flags, with one dash as its users know them.
const std::vector<std::string> drawing_flags = {"-notex", "-noshadow", "-noshadows", "-pause"};

// Takes drawstuff's flags out of the command line, which CLI11 would read as bundles of one-letter
// options.
std::vector<std::string> takeDrawingFlags(int argc, char** argv, Options& options) {
  std::vector<std::string> others;
  for (int i = 1; i < argc; ++i) {
    const bool ours = CLI::IsMember(drawing_flags)(std::string(argv[i])).empty();
    (ours ? options.drawing : others).emplace_back(argv[i]);
  }
  return others;
}

void addDrawingOptions(CLI::App& app, std::string& pictures, Options& options) {
  app.add_flag("--view", options.view,
               "Show the pile in a window, until it is closed or --steps are done. Also takes "
               "drawstuff's flags: -notex -noshadow -pause");
  app.add_option("--snapshot", options.snapshot,
                 "Draw the end into this PNG file; without --view no display is needed");
  app.add_option("--picture-of-times", options.times_picture,
                 "Draw where the time of a step went into this SVG file");
  app.add_option(
      "--pictures", pictures,
      "A folder for both: pile.png, if there is anything to draw it with, and times.svg");
}

bool endsWithPng(std::string name) {
  const std::string ending = ".png";
  if (name.size() < ending.size()) return false;
  name.erase(0, name.size() - ending.size());
  return CLI::detail::to_lower(name) == ending;
}

// --pictures is the two options for single pictures, of which one may be left out.
void takePictures(const CLI::App& app, const std::string& folder, Options& options) {
  if (!app.count("--pictures")) return;
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) throw UsageError("cannot make the folder " + folder);
  if (options.times_picture.empty()) options.times_picture = folder + "/times.svg";
  if (app.count("--snapshot")) return;
  options.snapshot = folder + "/pile.png";
  options.snapshot_if_possible = !options.view;
}

void checkDrawingOptions(const CLI::App& app, Options& options) {
  if (app.count("--snapshot") && options.snapshot.empty())
    throw UsageError("--snapshot: the name of the file is empty");
  if (app.count("--snapshot") && !endsWithPng(options.snapshot))
    throw UsageError("--snapshot: " + options.snapshot +
                     " does not end with .png, and pictures are PNG files only");
  if (!options.drawing.empty() && !options.view && options.snapshot.empty())
    throw UsageError(options.drawing.front() + " needs --view or --snapshot");
  if (options.view && !app.count("--steps")) options.steps = std::numeric_limits<int>::max();
}

void takeSpaceOptions(const CLI::App& app, const Names& names, Options& options) {
  options.space = space_names.at(names.space);
  if (app.count("--threads")) options.threads = names.threads;
  if (app.count("--method")) options.method = method_names.at(names.method);
  if (app.count("--backend")) options.backend = backend_names.at(names.backend);
  options.parallel_narrow =
      names.narrow.empty() ? options.space == SpaceKind::Parallel : names.narrow == "parallel";
  options.parallel_stepping = names.stepping == "parallel";
  if (options.check && options.rules.any())
    throw UsageError(
        "--check looks for all pairs of dHashSpace and no other: not with --tolerance, "
        "--skip-static, --skip-asleep or --cull-planes");
  if (options.space == SpaceKind::Parallel) return;
  if (options.rules.any())
    throw UsageError(
        "--tolerance, --skip-static, --skip-asleep and --cull-planes need --space parallel");
  if (options.compare) throw UsageError("--compare needs --space parallel");
  if (options.method || options.backend || options.parallel_narrow)
    throw UsageError("--method, --backend and --narrow parallel need --space parallel");
  if (options.threads && !options.parallel_stepping)
    throw UsageError("--threads needs --space parallel or --stepping parallel");
}

void takeSolverOptions(const Names& names, Options& options) {
  options.random_bodies = names.creation_order == "random";
  options.random_contacts = names.contact_order == "random";
  options.reducer = reducer_names.at(names.reduce);
  options.sleep = names.sleep == "on";
}

void fillFromPreset(Options& options) {
  const Preset& preset = presetOf(options.scene);
  if (!options.bodies) options.bodies = preset.bodies;
  if (!options.steps) options.steps = preset.steps;
  if (options.dt == 0) options.dt = preset.dt;
  if (!options.iterations) options.iterations = preset.iterations;
  if (!options.contacts) options.contacts = preset.contacts;
}

}  // namespace

std::optional<Options> parseOptions(int argc, char** argv) {
  CLI::App app{about, "pile"};
  app.footer(scenesHelp());
  Options options;
  Names names;
  addRunOptions(app, options);
  addSpaceOptions(app, names);
  addRules(app, options.rules);
  addSolverOptions(app, names, options);
  addDrawingOptions(app, names.pictures, options);
  std::vector<std::string> arguments = takeDrawingFlags(argc, argv, options);
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help();
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    throw UsageError(error.what());
  }
  takeSpaceOptions(app, names, options);
  takeSolverOptions(names, options);
  takePictures(app, names.pictures, options);
  checkDrawingOptions(app, options);
  fillFromPreset(options);
  const bool uses_hash = options.check || options.compare || options.space == SpaceKind::Hash;
  if (uses_hash && options.bodies + most_static_geoms > hash_space_limit)
    throw UsageError("dHashSpace, and so --check and --compare, takes at most " +
                     std::to_string(hash_space_limit - most_static_geoms) + " bodies");
  return options;
}

}  // namespace pile
