// Scenes with an analytic answer, and how far ODE is from it.
#include <cmath>
#include <deque>
#include <utility>

#include "extreme.h"

namespace sap_test::physics {
namespace {

Setting undivided(Setting setting) {
  setting.divide = 1;
  return setting;
}

// Each step of it is one of the solver's.
struct World : Stage {
  explicit World(const Setting& setting, const Vec& gravity = {0, 0, -kGravity}, double step = 0.01)
      : Stage(Pairing::hash, undivided(setting), step / setting.divide, gravity),
        dt(step / setting.divide) {
    dRandSetSeed(setting.start);  // QuickStep shuffles its rows
    seedOnce();
    friction = 0.6;
  }
  void until(double end) {
    while (time < end) step();
  }

  const double dt;
};

const Thing kFloor = {Thing::plane}, kBlock = {Thing::box, {0, 0, 0.05}, {0.5, 0.5, 0.1}};
constexpr double kRadius = 0.25;

Thing ballAt(const Vec& at, double density = 1000) {
  return {Thing::ball, at, {kRadius}, density};
}

// A block that slides to a stop, at an angle to the axes that ODE gives a contact by itself.
Quantities slide(const Setting& setting, double phase, double degrees, bool directed) {
  World world(setting);
  world.add({kFloor, kBlock});
  const double speed = 3 * (1 + 0.1 * phase);
  const Vec way = {std::cos(degrees * kPi / 180), std::sin(degrees * kPi / 180), 0};
  world.push(0, speed * way);
  if (directed)  // fdir1 is given
    world.surface = [way](dContact& contact) {
      contact.surface.mode |= dContactFDir1;
      for (std::size_t i = 0; i < 3; ++i) contact.fdir1[i] = real(way[i]);
    };
  world.until(1.2);
  const Vec at = world.place(0);
  const double exact = speed * speed / (2 * world.friction * kGravity);
  return {{"way", std::hypot(at[0], at[1]), exact, exact}};
}

// Two balls of 1:3 of mass head on.
Quantities collide(const Setting& setting, double phase) {
  World world(setting, {0, 0, 0});
  world.friction = 0;
  world.add({ballAt({}), ballAt({1 + 0.1 * phase, 0, 0}, 3000)});
  world.push(0, {2, 0, 0});
  world.push(1, {-1, 0, 0});
  world.until(1);
  const double one = world.speed(0)[0], other = world.speed(1)[0];
  return {{"separation", other - one, 0, 3}, {"momentum", one + 3 * other, -1, 9}};
}

// A free body that turns about its axis and wobbles: after which time the wobble halves, or doubles
// (negative), and what near ln 2 / (|axial / transverse inertia - 1| rate^2 step) gives.
Quantities wobble(const Setting& setting, const dMass& mass) {
  World world(setting, {0, 0, 0});
  const double rate = 10, ratio = double(mass.I[10] / mass.I[0]);
  world.body(nullptr, mass, {});
  world.spin(0, {0.02 * rate, 0, rate});
  const auto angle = [&world] {  // in the body's own axes, which are those of its inertia
    const Vec w = world.rate(0);
    dVector3 local;
    dBodyVectorFromWorld(world[0], real(w[0]), real(w[1]), real(w[2]), local);
    return std::hypot(double(local[0]), double(local[1])) / std::fabs(double(local[2]));
  };
  const double start = angle();
  while (angle() > start / 2 && angle() < start * 2 && world.time < 100) world.step();
  const double time = angle() < start ? world.time : -world.time;
  const double exact = std::log(2.0) / ((ratio - 1) * rate * rate * world.dt);
  return {{"half-life", time, exact, std::fabs(exact)}};
}

Quantities wobbleOfRound(const Setting& setting, double radius, double length) {
  dMass mass;
  dMassSetCylinder(&mass, 1000, 3, real(radius), real(length));
  return wobble(setting, mass);
}

Quantities wobbleOfBox(const Setting& setting, double) {
  dMass mass;
  dMassSetBox(&mass, 1000, real(0.4), real(0.4), 1);
  return wobble(setting, mass);
}

// What dJointFeedback says of the floor's contacts from `from` seconds on, in parts of the weight:
// how far it is from the weight on average; and how far a body of 1 m has sunk.
Quantities forces(World& world, double from, double until, std::size_t body,
                  const std::function<void(Stage&)>& drive) {
  std::deque<dJointFeedback> feedback;
  world.joined = [&](dJointID joint) {
    if (!dJointGetBody(joint, 1)) dJointSetFeedback(joint, &feedback.emplace_back());
  };
  double weight = 0, off = 0, count = 0;
  for (const dBodyID b : world.bodies()) weight += kGravity * tradeoff::massOf(b);
  const double height = world.place(body)[2];
  while (world.time < until) {
    feedback.clear();
    if (drive) drive(world);
    world.step();
    if (world.time < from) continue;
    double sum = 0;
    for (const dJointFeedback& each : feedback) sum += double(each.f1[2]);
    off += std::fabs(sum / weight - 1);
    ++count;
  }
  return {{"force", off / count, 0, 1}, {"drop", std::fabs(height - world.place(body)[2]), 0, 1}};
}

Quantities stackForces(const Setting& setting, double phase) {
  World world(setting);
  world.friction = 0.8;
  world.add(kFloor);
  for (int i = 0; i < 5; ++i) world.add({Thing::box, {0.01 * phase * (i % 2), 0, i + 0.5}});
  return forces(world, 2, 4, 4, nullptr);
}

Quantities humanoidForces(const Setting& setting, double phase) {
  const Extreme humanoid = machines().back();
  World world(setting, humanoid.gravity, humanoid.step);
  world.friction = 0.8;
  world.add(humanoid.things);
  humanoid.build(world);
  world.push(0, {1e-4 * phase, 0, 0});
  return forces(world, 1, 3, 0, humanoid.drive);
}

// Ten links of 0.2 m that fall, begun so many degrees above level: energy after two seconds.
Quantities chain(const Setting& setting, double phase, double degrees) {
  World world(setting);
  const int links = 10;
  const double side = 0.2, tilt = 0.01 * phase - degrees * kPi / 180;
  const Vec way = {std::cos(tilt), 0, -std::sin(tilt)};
  dMass mass;
  dMassSetBox(&mass, 1000, real(side), real(0.05), real(0.05));
  for (int i = 0; i < links; ++i) {
    const dBodyID link = world.body(nullptr, mass, side * (i + 0.5) * way);
    world.turn(size_t(i), {0, 1, 0}, tilt);
    world.ballJoint(link, i ? world[size_t(i) - 1] : nullptr, side * i * way);
  }
  const double start = world.energy(),
               scale = tradeoff::massOf(world[0]) * kGravity * links * links * side / 2;
  world.until(2 - world.dt / 2);
  return {{"energy", world.energy(), start, scale}};
}

// 6 x 6 x 6 balls with a restitution of 1 and no friction, which fall on each other: energy. Sizes
// and masses are those of SimBenchmark's "elastic 666".
Quantities balls(const Setting& setting, double phase) {
  World world(setting);
  world.friction = 0;
  world.bounce = 1;
  world.add(kFloor);
  const double radius = 0.1, cell = 0.21, shift = 0.001;
  for (int i = 0; i < 216; ++i) {
    const auto off = [&](int n) { return shift * std::sin(17 * i + 5 * n + 6 * phase); };
    world.add({Thing::ball,
               {cell * (i % 6) + off(1), cell * (i / 6 % 6) + off(2), 1.101 + cell * (i / 36)},
               {radius},
               10 / (4 * kPi / 3 * radius * radius * radius)});
  }
  const double start = world.energy();
  world.until(2);
  return {{"energy", world.energy(), start, start}};
}

constexpr double kRounding = sizeof(dReal) == 8 ? 1e-9 : 1e-4;

}  // namespace

std::vector<Scene> truthScenes() {
  std::vector<Scene> all;
  // A phase for each run, bounds for steps of 2.5 ms and 50 iterations.
  const auto add = [&all](const char* name, const char* of, Scene::Kind kind,
                          std::function<Quantities(const Setting&, double phase)> play,
                          std::vector<Bound> bounds = {}) {
    const auto run = [play](const Setting& setting, int run) {
      return play(setting, phaseOf(run));
    };
    all.push_back({name, of, run, kind, kind == Scene::slow ? 6 : 40, std::move(bounds)});
  };
  using std::bind;
  using std::placeholders::_1;
  using std::placeholders::_2;
  const char* const block = "block 0.5 x 0.5 x 0.1 m, 25 kg, friction 0.6";
  const char* const links = "10 links 0.2 m, 0.5 kg";
  add("slide at 0 degrees", block, Scene::contact, bind(slide, _1, _2, 0, false),
      {{"way", 0.004, 0.006}});
  add("slide at 45 degrees", block, Scene::contact, bind(slide, _1, _2, 45, false),
      {{"way", 0.29, 0.305}});  // 1 - 1 / sqrt(2)
  add("slide at 45 degrees along fdir1", block, Scene::contact, bind(slide, _1, _2, 45, true),
      {{"way", 0.004, 0.006}});
  add("collide inelastically", "balls 0.5 m, 65 and 196 kg", Scene::contact, collide,
      {{"separation", 0.08, 0.13}, {"momentum", 0, kRounding}});  // ERP / 2 on average
  add("chain from 6 degrees below level", links, Scene::contact, bind(chain, _1, _2, -6));
  add("chain from level", links, Scene::contact, bind(chain, _1, _2, 0), {{"energy", 0, 0.06}});
  add("chain from 6 degrees above level", links, Scene::contact, bind(chain, _1, _2, 6));
  add("force under a stack", "5 boxes of 1 m, 1,000 kg", Scene::slow, stackForces);
  add("force under a humanoid", "70 kg, feet 1 kg, 5 ms", Scene::slow, humanoidForces);
  add("wobble of a disc", "0.5 m x 0.05 m, 10 rad/s", Scene::free,
      bind(wobbleOfRound, _1, 0.5, 0.05), {{"half-life", 0.25, 0.4}});
  add("wobble of a drum", "0.5 m x 0.5 m, 10 rad/s", Scene::free, bind(wobbleOfRound, _1, 0.5, 0.5),
      {{"half-life", 0.15, 0.25}});
  add("wobble of a rod", "0.05 m x 1 m, 10 rad/s", Scene::free, bind(wobbleOfRound, _1, 0.05, 1),
      {{"half-life", 0.8, 0.92}});
  add("wobble of a box", "0.4 x 0.4 x 1 m, 10 rad/s", Scene::free, wobbleOfBox,
      {{"half-life", 0.5, 0.62}});
  add("elastic balls", "216 of 0.2 m, 10 kg", Scene::slow, balls, {{"energy", 0, 0.005}});
  return all;
}

}  // namespace sap_test::physics
