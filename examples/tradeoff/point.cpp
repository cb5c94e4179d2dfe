// Measures one point of the trade-off study and prints it as two lines of CSV. The study itself,
// which chooses the points, is tradeoff.py.
#include <ode/ode.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "broad_point.h"
#include "scenes.h"
#include "trace_point.h"

namespace {

void addBroad(CLI::App& app, tradeoff::BroadSettings& settings) {
  app.add_option("--space", settings.space)->check(CLI::IsMember({"parallel", "hash", "sap"}));
  app.add_option("--backend", settings.backend)->check(CLI::IsMember({"cpu", "cuda"}));
  app.add_option("--threads", settings.threads)->check(CLI::Range(0, 256));
  app.add_option("--tolerance", settings.tolerance)->check(CLI::Range(0.0, 100.0));
  app.add_option("--offset", settings.offset);
  app.add_option("--step", settings.step)->check(CLI::Range(0.0, 10.0));
  app.add_option("--boxes", settings.boxes)->check(CLI::Range(2, 1000000));
  app.add_option("--frames", settings.frames)->check(CLI::Range(1, 100000));
  app.add_option("--seed", settings.seed);
}

// The harness reads the settings; here only what makes the scene. Exit code as that of the harness.
int measureScene(CLI::App& command, const std::string& name, int bodies, double density) {
  std::vector<std::string> words = command.remaining();
  std::vector<char*> arguments = {const_cast<char*>("tradeoff-point")};
  for (std::string& word : words) arguments.push_back(word.data());
  return tradeoff::run(static_cast<int>(arguments.size()), arguments.data(),
                       tradeoff::sceneNamed(name, bodies, density));
}

void addTrace(CLI::App& app, tradeoff::TraceSettings& settings) {
  app.add_option("--file", settings.file)->required();
  app.add_option("--space", settings.space)->check(CLI::IsMember({"parallel", "hash", "sap"}));
  app.add_option("--work", settings.work)->check(CLI::IsMember({"pairs", "loop", "contacts"}));
  app.add_option("--skip", settings.skip)
      ->check(CLI::IsMember({"nothing", "static", "asleep", "planes", "all"}));
  app.add_option("--threads", settings.threads)->check(CLI::Range(1, 256));
  app.add_option("--devices", settings.devices)->check(CLI::Range(0, 1024));
  app.add_option("--tolerance", settings.tolerance)->check(CLI::Range(0.0, 100.0));
  app.add_option("--contacts", settings.contacts)->check(CLI::Range(1, 1000));
  app.add_option("--turns", settings.turns)->check(CLI::Range(1, 100000));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Measures one point of the trade-off study"};
  tradeoff::BroadSettings broad;
  tradeoff::TraceSettings trace;
  CLI::App* broad_command = app.add_subcommand("broad", "The broad phase alone");
  CLI::App* scene_command = app.add_subcommand("scene", "A scene of the study's, by the harness");
  CLI::App* trace_command = app.add_subcommand("trace", "The frames of another program");
  CLI::App* precision_command = app.add_subcommand("precision", "Of this build's ODE");
  addBroad(*broad_command, broad);
  std::string name;
  int bodies = 30;
  double density = 1000;  // kg/m^3
  scene_command->add_option("--scene", name)
      ->required()
      ->check(CLI::IsMember({"heap", "wall", "tower", "hopper", "vehicle", "meshes"}));
  scene_command->add_option("--bodies", bodies)->check(CLI::Range(2, 100000));
  scene_command->add_option("--density", density)->check(CLI::Range(0.001, 100000.0));
  scene_command->allow_extras();
  addTrace(*trace_command, trace);
  app.require_subcommand(1);
  CLI11_PARSE(app, argc, argv);
  if (*precision_command) {
    std::puts(sizeof(dReal) == sizeof(double) ? "double" : "single");
    return 0;
  }
  try {
    if (*scene_command) return measureScene(*scene_command, name, bodies, density);
    dInitODE2(0);
    dAllocateODEDataForThread(dAllocateMaskAll);
    const tradeoff::Row row =
        *trace_command ? tradeoff::measureTrace(trace) : tradeoff::measureBroadPhase(broad);
    std::fputs(row.text().c_str(), stdout);
    dCloseODE();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tradeoff-point: %s\n", error.what());
    return 2;
  }
}
