// Runs the piles of examples/pile until they have come to rest and traces frames of each:
//
//   record-piles <directory> <scene>...    the last frames: <directory>/<scene>.trace
//   record-piles <directory> <scene>-run   two frames at each of 25 moments of the whole run:
//                                          <directory>/<scene>-<step>.trace
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdarg>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "scenes.h"
#include "simulation.h"
#include "spaces.h"

namespace {

constexpr int frames_at_rest = 6;
constexpr int moments_of_run = 25, frames_of_moment = 2;

// ODE complains in a debug build, thousands of times, when two fine meshes touch in many points.
void ignoreMessage(int, const char*, va_list) {}

void record(const std::string& directory, const std::string& wish) {
  const std::string scene = wish.substr(0, wish.find("-run"));
  const bool whole_run = scene != wish;
  const pile::Preset& preset = pile::presetOf(scene);
  pile::Options options;
  options.scene = preset.name;
  options.bodies = preset.bodies;
  options.steps = preset.steps;
  pile::World world;
  pile::Random random(options.seed);
  preset.build(world, options.bodies, random);
  const dSpaceID space = pile::createSpace(options);
  world.useSpace(space);
  pile::Simulation simulation(world, options);
  const int every = whole_run ? options.steps / moments_of_run : options.steps;
  const int frames = whole_run ? frames_of_moment : frames_at_rest;
  for (int step = 1; step <= options.steps; ++step) {
    const int end = (step + every - 1) / every * every;  // the last step of this moment
    if (step == end - frames + 1) {
      char number[16] = "";
      if (whole_run) std::snprintf(number, sizeof number, "-%04d", end);
      const std::string path = directory + "/" + scene + number + ".trace";
      if (!dParallelSAPSpaceSetTrace(space, path.c_str(), 1))
        throw std::runtime_error("cannot write " + path);
    }
    simulation.step();
    if (step == end) dParallelSAPSpaceSetTrace(space, nullptr, 0);
  }
  std::printf("%s: %d bodies, %d steps\n", wish.c_str(), options.bodies, options.steps);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: record-piles <directory> <scene>[-run]...\n");
    return 2;
  }
  dSetMessageHandler(ignoreMessage);
  try {
    for (int i = 2; i < argc; ++i) record(argv[1], argv[i]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "record-piles: %s\n", error.what());
    return 1;
  }
}
