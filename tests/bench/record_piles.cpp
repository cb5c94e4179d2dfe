// Runs the piles of examples/pile until they have come to rest and records some frames of each:
//
//   record-piles <directory> [<scene>[=<steps>] ...]     writes <directory>/<scene>.pile
//
// The steps left out are the scene's own. A file that is there already is kept.
#include <cstdarg>
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

PileRecording record(const pile::Preset& preset, int steps) {
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
  for (int i = 0; i < steps; ++i) {
    simulation.step();
    if (i >= steps - frames_recorded) recordFrame(world, recording);
  }
  return recording;
}

void recordTo(const std::string& directory, const std::string& wish) {
  const std::size_t equals = wish.find('=');
  const pile::Preset& preset = pile::presetOf(wish.substr(0, equals));
  const int steps =
      equals == std::string::npos ? preset.steps : std::atoi(wish.c_str() + equals + 1);
  if (steps < frames_recorded)
    throw std::invalid_argument("at least " + std::to_string(frames_recorded) + " steps: " + wish);
  const std::string path = directory + "/" + preset.name + ".pile";
  if (pileExists(path)) {
    std::printf("%s is there already\n", path.c_str());
    return;
  }
  const Stopwatch clock;
  writePile(path, record(preset, steps));
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
    std::fprintf(stderr, "usage: record-piles <directory> [<scene>[=<steps>] ...]\n");
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
