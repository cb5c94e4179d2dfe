#include "pile_point.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "../pile/motion.h"
#include "../pile/random.h"
#include "../pile/simulation.h"
#include "../pile/spaces.h"
#include "balance.h"

namespace tradeoff {
namespace {

// Boxes in layers over a pit that is about as wide as a layer, tilted a little so that they do not
// stack like bricks.
void buildPit(pile::World& world, int bodies, pile::Random& random) {
  constexpr double cell = 1.6;
  constexpr double layer = 1.25;
  constexpr double tilt = 0.1;  // radians
  const int across = std::max(2, static_cast<int>(std::lround(std::cbrt(bodies / 2.0))));
  const dReal wall = static_cast<dReal>(-cell * across / 2);
  world.addStatic(dCreatePlane(nullptr, 0, 0, 1, 0));
  world.addStatic(dCreatePlane(nullptr, 1, 0, 0, wall));
  world.addStatic(dCreatePlane(nullptr, -1, 0, 0, wall));
  world.addStatic(dCreatePlane(nullptr, 0, 1, 0, wall));
  world.addStatic(dCreatePlane(nullptr, 0, -1, 0, wall));
  world.body_name = "boxes";
  world.ground_name = "a pit";
  world.body_size = 0.8;
  // Whoever is beyond a wall fell through it.
  world.ground_height = [wall](double x, double y) {
    return std::max(std::abs(x), std::abs(y)) > -wall ? std::numeric_limits<double>::infinity() : 0;
  };
  for (int i = 0; i < bodies; ++i) {
    dReal side[3];
    for (dReal& length : side) length = static_cast<dReal>(random.uniform(0.6, 1.0));
    dMass mass;
    dMassSetBox(&mass, 1, side[0], side[1], side[2]);
    pile::Pose pose;
    pose.position = {cell * (i % across - (across - 1) / 2.0),
                     cell * (i / across % across - (across - 1) / 2.0),
                     1 + layer * (i / (across * across))};
    const double angle = random.uniform(0, 3.14159265358979);
    pose.rotation[0] = static_cast<dReal>(std::cos(angle / 2));
    pose.rotation[1] = static_cast<dReal>(random.uniform(-tilt, tilt));
    pose.rotation[2] = static_cast<dReal>(random.uniform(-tilt, tilt));
    pose.rotation[3] = static_cast<dReal>(std::sin(angle / 2));
    world.addBody(dCreateBox(nullptr, side[0], side[1], side[2]), mass, pose);
  }
}

// The physics of pile, but for what hides errors: nothing sleeps and nothing is damped.
void showAll(const pile::World& world) {
  for (size_t i = 0; i < world.bodies().size(); ++i) {
    const dBodyID body = world.bodies()[i];
    dBodySetAutoDisableFlag(body, 0);
    dBodySetLinearDamping(body, 0);
    dBodySetAngularDamping(body, 0);
    dBodySetData(body, reinterpret_cast<void*>(static_cast<std::uintptr_t>(i)));
  }
}

double meanHeight(const pile::World& world) {
  double sum = 0;
  for (dBodyID body : world.bodies()) sum += static_cast<double>(dBodyGetPosition(body)[2]);
  return sum / static_cast<double>(world.bodies().size());
}

// Sums over steps. A pair counts once, with the deepest of its contacts.
struct Penetration {
  double sum = 0;
  double largest = 0;
  size_t pairs = 0;

  void add(const std::vector<dContactGeom>& contacts) {
    for (size_t i = 0; i < contacts.size();) {
      const size_t first = i;
      double deepest = 0;
      for (; i < contacts.size() && contacts[i].g1 == contacts[first].g1 &&
             contacts[i].g2 == contacts[first].g2;
           ++i)
        deepest = std::max(deepest, static_cast<double>(contacts[i].depth));
      sum += deepest;
      largest = std::max(largest, deepest);
      ++pairs;
    }
  }

  double mean() const { return pairs ? sum / static_cast<double>(pairs) : 0; }
};

// A heap without a push from outside only ever loses energy: each rise is an error.
struct EnergyLog {
  double start = 0;
  double last = 0;
  double rises = 0;

  explicit EnergyLog(double energy) : start(energy), last(energy) {}
  void add(double energy) {
    rises += std::max(0.0, energy - last);
    last = energy;
  }
};

pile::Options optionsFor(const PileSettings& settings) {
  pile::Options options;
  options.scene = "cubes";
  options.bodies = settings.bodies;
  options.dt = settings.dt;
  options.iterations = settings.iterations;
  options.contacts = settings.contacts;
  options.seed = settings.seed;
  options.threads = settings.parallel ? 0 : 1;
  options.parallel_narrow = settings.parallel;
  options.parallel_stepping = settings.parallel;
  return options;
}

}  // namespace

Row measurePile(const PileSettings& settings) {
  const pile::Options options = optionsFor(settings);
  pile::World world;
  pile::Random random(settings.seed);
  buildPit(world, settings.bodies, random);
  world.useSpace(pile::createSpace(options, world.geoms()));
  pile::Simulation simulation(world, options);
  showAll(world);
  Balance balance(world.ode(), world.bodies());
  simulation.watchJoints([&](dJointID joint) { balance.watch(joint); });

  const long steps = std::lround(settings.seconds / settings.dt);
  const long fall_steps = std::lround((settings.seconds - settings.rest_seconds) / settings.dt);
  Penetration falling, resting;
  EnergyLog energy(pile::measure(world).energy);
  double rises_falling = 0, energy_at_rest = 0, height = 0, wall_ms = 0;
  pile::Motion motion;
  for (long step = 1; step <= steps; ++step) {
    const pile::Frame frame = simulation.step();
    wall_ms += frame.totalMs();
    balance.close(settings.dt);
    motion = pile::measure(world);
    energy.add(motion.energy);
    (step > fall_steps ? resting : falling).add(simulation.contacts());
    if (step == fall_steps) {
      rises_falling = energy.rises;
      energy_at_rest = motion.energy;
    }
    if (step > fall_steps) height += meanHeight(world) / static_cast<double>(steps - fall_steps);
    if (motion.not_finite) break;
  }

  const double released = energy.start - energy.last;
  Row row;
  row.add("wall_s_per_s", wall_ms / 1000 / settings.seconds);
  row.add("height_m", height);
  row.add("penetration_mm", 1000 * resting.mean());
  row.add("largest_mm", 1000 * resting.largest);
  row.add("largest_falling_mm", 1000 * falling.largest);
  row.add("energy_gain_falling", rises_falling / released);
  row.add("energy_gain_rest", (energy.rises - rises_falling) / released / settings.rest_seconds);
  row.add("energy_drift_rest", (energy.last - energy_at_rest) / released / settings.rest_seconds);
  row.add("momentum_drift", balance.linearDrift());
  row.add("angular_drift", balance.angularDrift());
  row.add("fastest_m_s", motion.fastest);
  row.add("lost", motion.fallen + motion.not_finite);
  return row;
}

}  // namespace tradeoff
