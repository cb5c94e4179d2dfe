// Measures one point of the trade-off study and prints it as two lines of CSV. The study itself,
// which chooses the points, is tradeoff.py.
#include <ode/ode.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "broad_point.h"
#include "pile_point.h"
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

void addPile(CLI::App& app, tradeoff::PileSettings& settings) {
  app.add_option("--dt", settings.dt)->check(CLI::Range(1e-5, 0.1));
  app.add_option("--iterations", settings.iterations)->check(CLI::Range(1, 10000));
  app.add_option("--contacts", settings.contacts)->check(CLI::Range(1, 64));
  app.add_flag("--parallel", settings.parallel);
  app.add_option("--bodies", settings.bodies)->check(CLI::Range(2, 100000));
  app.add_option("--seconds", settings.seconds)->check(CLI::Range(0.1, 1000.0));
  app.add_option("--rest-seconds", settings.rest_seconds)->check(CLI::Range(0.05, 1000.0));
  app.add_option("--seed", settings.seed);
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
  tradeoff::PileSettings pile;
  tradeoff::TraceSettings trace;
  CLI::App* broad_command = app.add_subcommand("broad", "The broad phase alone");
  CLI::App* pile_command = app.add_subcommand("pile", "A heap of boxes in a pit");
  CLI::App* trace_command = app.add_subcommand("trace", "The frames of another program");
  CLI::App* precision_command = app.add_subcommand("precision", "Of this build's ODE");
  addBroad(*broad_command, broad);
  addPile(*pile_command, pile);
  addTrace(*trace_command, trace);
  app.require_subcommand(1);
  CLI11_PARSE(app, argc, argv);
  if (*precision_command) {
    std::puts(sizeof(dReal) == sizeof(double) ? "double" : "single");
    return 0;
  }
  if (*pile_command && pile.rest_seconds >= pile.seconds) {
    std::fputs("tradeoff-point: --rest-seconds must be less than --seconds\n", stderr);
    return 2;
  }
  try {
    if (*pile_command) {
      std::fputs(tradeoff::measurePile(pile).text().c_str(), stdout);
    } else {
      dInitODE2(0);
      dAllocateODEDataForThread(dAllocateMaskAll);
      const tradeoff::Row row =
          *trace_command ? tradeoff::measureTrace(trace) : tradeoff::measureBroadPhase(broad);
      std::fputs(row.text().c_str(), stdout);
      dCloseODE();
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tradeoff-point: %s\n", error.what());
    return 2;
  }
}
