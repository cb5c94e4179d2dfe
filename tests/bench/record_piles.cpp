// Runs the piles of examples/pile until they have come to rest and records some frames of each:
//
//   record-piles <directory> [<scene>[-run][=<steps>] ...]     writes <directory>/<scene>.pile
//
// The steps left out are the scene's own. A file that is there already is kept. With -run, frames
// are taken from the first step to the last, two in a row each time, and <scene>-run.pile has no
// bounds.
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include "pile_recording.h"
#include "presets.h"
#include "simulation.h"
#include "spaces.h"
#include "stopwatch.h"

namespace bench {
namespace {

constexpr int frames_recorded = 6;
constexpr int moments_of_run = 24;

BodyPose poseOf(dBodyID body) {
  BodyPose pose;
  const dReal* position = dBodyGetPosition(body);
  const dReal* rotation = dBodyGetQuaternion(body);
  for (int i = 0; i < 3; ++i) pose.position[i] = position[i];
  for (int i = 0; i < 4; ++i) pose.rotation[i] = rotation[i];
  return pose;
}

CentredBox boundsOf(dGeomID geom) {
  dReal bounds[6];
  dGeomGetAABB(geom, bounds);
  CentredBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.centre[axis] = (bounds[2 * axis] + bounds[2 * axis + 1]) / 2;
    box.half[axis] = (bounds[2 * axis + 1] - bounds[2 * axis]) / 2;
  }
  return box;
}

void recordFrame(const pile::World& world, PileRecording& recording) {
  auto& poses = recording.poses.emplace_back();
  Boxes& boxes = recording.boxes.emplace_back();
  for (dBodyID body : world.bodies()) {
    poses.push_back(poseOf(body));
    boxes.push_back(boundsOf(dBodyGetFirstGeom(body)));
  }
}

// Whether the step and the one before it are recorded.
bool endsMoment(int step, int steps) {
  return std::int64_t{step} * moments_of_run / steps !=
         std::int64_t{step - 1} * moments_of_run / steps;
}

PileRecording record(const pile::Preset& preset, int steps, bool whole_run) {
  pile::Options options;
  options.scene = preset.name;
  options.bodies = preset.bodies;
  options.steps = steps;
  options.dt = preset.dt;
  options.iterations = preset.iterations;
  options.contacts = preset.contacts;
  pile::World world;
  pile::Random random(options.seed);
  preset.build(world, options.bodies, random);
  world.useSpace(pile::createSpace(options, world.geoms()));
  pile::Simulation simulation(world, options);
  PileRecording recording;
  recording.scene = preset.name;
  for (int step = 1; step <= steps; ++step) {
    simulation.step();
    if (!whole_run) {
      if (step > steps - frames_recorded) recordFrame(world, recording);
    } else if (endsMoment(step, steps) || endsMoment(step + 1, steps)) {
      recordFrame(world, recording);
      recording.steps.push_back(static_cast<std::uint32_t>(step));
    }
  }
  return recording;
}

void recordTo(const std::string& directory, const std::string& wish) {
  const std::size_t equals = wish.find('=');
  const std::string name = wish.substr(0, equals);
  const std::size_t dash = name.find("-run");
  const pile::Preset& preset = pile::presetOf(name.substr(0, dash));
  const int steps =
      equals == std::string::npos ? preset.steps : std::atoi(wish.c_str() + equals + 1);
  const int least = dash == std::string::npos ? frames_recorded : 3 * moments_of_run;
  if (steps < least)
    throw std::invalid_argument("at least " + std::to_string(least) + " steps: " + wish);
  const std::string path = directory + "/" + name + ".pile";
  if (pileExists(path)) {
    std::printf("%s is there already\n", path.c_str());
    return;
  }
  const Stopwatch clock;
  writePile(path, record(preset, steps, dash != std::string::npos));
  std::printf("%s: %d bodies after %d steps, in %.0f s\n", path.c_str(), preset.bodies, steps,
              clock.milliseconds() / 1000);
}

// ODE complains in a debug build, thousands of times, when two fine meshes touch in many points.
int messages = 0;

void countMessage(int, const char*, va_list) {
  ++messages;
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: record-piles <directory> [<scene>[-run][=<steps>] ...]\n");
    return 2;
  }
  std::vector<std::string> scenes(argv + 2, argv + argc);
  if (scenes.empty()) scenes = {"cubes", "balls", "skittles"};
  dSetMessageHandler(bench::countMessage);
  try {
    for (const std::string& scene : scenes) bench::recordTo(argv[1], scene);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "record-piles: %s\n", error.what());
    return 1;
  }
  if (bench::messages > 0) std::printf("ODE had %d messages\n", bench::messages);
}
