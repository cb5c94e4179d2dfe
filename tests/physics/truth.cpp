// Scenes with an analytic answer, and how far ODE is from it:
//
//     physics-truth rows ROWS.csv [SCENE]   plays all scenes with all settings, and writes a row
//     for
//                                     each; or adds the rows of one scene
//     physics-truth check             plays each scene at one setting, and holds it against bounds
//
// In the precision of the ODE that it is built with.
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>

#include <ctime>
#include <deque>

#include "../support/bounds.h"
#include "extreme.h"

namespace sap_test::physics {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kGravity = 9.81;
constexpr int kStreams = 40;  // runs of a scene: starts a little apart, random numbers of their own

struct TruthSetting : Setting {
  const char* name = "as ODE comes";
  bool soft = false;  // CFM is step / mass of the lightest body
  double dt = 0.01;
  bool directed = false;  // fdir1 is given: along the sliding, or along the push of a body at rest
};

long steps_played = 0;  // of all worlds

class World : public Stage {
 public:
  explicit World(const TruthSetting& setting, const Vec& gravity = {0, 0, -kGravity})
      : Stage(Pairing::hash, setting, setting.dt), setting_(setting), gravity_(gravity) {
    dWorldSetGravity(world(), real(gravity[0]), real(gravity[1]), real(gravity[2]));
    dRandSetSeed(setting.start);  // QuickStep shuffles its rows
    seedOnce();
    friction = 0.6;
    surface = [this](dContact& contact, dBodyID a, dBodyID b) {
      if (bounce > 0) {
        contact.surface.mode |= dContactBounce;
        contact.surface.bounce = real(bounce);
      }
      if (setting_.directed) direct(contact, a, b);
    };
  }

  dBodyID freeBox(const Vec& side, const Vec& place) {
    dMass mass;
    dMassSetBox(&mass, 1000, real(side[0]), real(side[1]), real(side[2]));
    return body(nullptr, mass, place);
  }

  void step() {
    if (setting_.soft && time == 0) {
      double lightest = 1e300;
      for (const dBodyID b : bodies()) lightest = std::min(lightest, tradeoff::massOf(b));
      dWorldSetCFM(world(), real(setting_.dt / lightest));
    }
    depth = 0;
    Stage::step();
    ++steps_played;
    time += setting_.dt;
  }

  // Angular velocity in the body's own axes, which are those of its inertia.
  static Vec rate(dBodyID b) {
    dVector3 local;
    const dReal* w = dBodyGetAngularVel(b);
    dBodyVectorFromWorld(b, w[0], w[1], w[2], local);
    return vec(local);
  }

  double dt() const { return setting_.dt; }

  double bounce = 0;
  double time = 0;

 private:
  void direct(dContact& contact, dBodyID a, dBodyID b) const {
    const dReal* p = contact.geom.pos;
    const Vec normal = vec(contact.geom.normal);
    dVector3 va = {}, vb = {};
    if (a) dBodyGetPointVel(a, p[0], p[1], p[2], va);
    if (b) dBodyGetPointVel(b, p[0], p[1], p[2], vb);
    const auto along = [&normal](const Vec& v) { return minus(v, dot(v, normal) * normal); };
    Vec way = along(minus(vec(va), vec(vb)));
    if (length(way) < 2 * kGravity * setting_.dt) way = along(gravity_);
    if (length(way) < 1e-9) return;
    contact.surface.mode |= dContactFDir1;
    for (std::size_t i = 0; i < 3; ++i) contact.fdir1[i] = real(way[i] / length(way));
  }

  const TruthSetting setting_;
  const Vec gravity_;
};

// What is measured at the end of a scene. The error is the difference in parts of `scale`.
struct Quantity {
  const char* name;
  double value, exact, scale;
};
using Quantities = std::vector<Quantity>;

Vec heading(double degrees) {
  const double angle = degrees * kPi / 180;
  return {std::cos(angle), std::sin(angle), 0};
}

constexpr double kRadius = 0.25;

// A block that slides to a stop, at an angle to the axes that ODE gives a contact by itself.
Quantities slide(const TruthSetting& setting, double phase, double degrees) {
  World world(setting);
  world.plane();
  const dBodyID block = world.box({0, 0, 0.05}, {0.5, 0.5, 0.1});
  const double speed = 3 * (1 + 0.1 * phase);
  world.push(0, speed * heading(degrees));
  while (world.time < 1.2) world.step();
  const Vec at = vec(dBodyGetPosition(block));
  const double exact = speed * speed / (2 * world.friction * kGravity);
  return {{"way", std::hypot(at[0], at[1]), exact, exact}};
}

// A block at rest on a slope of so many times the angle of friction, whose downhill is at an angle
// to the axes. The slope is the floor, gravity is tilted.
Quantities slope(const TruthSetting& setting, double phase, double times, double degrees) {
  const double mu = 0.6, angle = times * std::atan(mu);
  const Vec downhill = heading(degrees);
  World world(setting, kGravity * (std::sin(angle) * downhill + Vec{0, 0, -std::cos(angle)}));
  world.friction = mu;
  world.plane();
  const dBodyID block = world.box({0, 0, 0.05}, {0.5, 0.5, 0.1});
  const double end = 1 + 0.1 * phase;
  while (world.time < end - setting.dt / 2) world.step();
  const double free = kGravity * std::sin(angle) * world.time * world.time / 2;
  const double exact = times < 1 ? 0 : free * (1 - mu / std::tan(angle));
  return {{"way", dot(vec(dBodyGetPosition(block)), downhill), exact, times < 1 ? free : exact}};
}

// A ball that slides first and rolls then, at 5/7 of its speed.
Quantities roll(const TruthSetting& setting, double phase, double degrees) {
  World world(setting);
  world.plane();
  const dBodyID ball = world.ball({0, 0, kRadius}, kRadius, 1000);
  const double speed = 3 * (1 + 0.1 * phase);
  world.push(0, speed * heading(degrees));
  while (world.time < 2) world.step();
  const Vec v = vec(dBodyGetLinearVel(ball));
  return {{"speed", std::hypot(v[0], v[1]), speed * 5 / 7, speed * 5 / 7}};
}

// A ball that falls: its speed where it meets the floor, and how deep its first contact is.
Quantities fall(const TruthSetting& setting, double phase) {
  World world(setting);
  world.plane();
  const double height = 1 + 0.1 * phase, exact = std::sqrt(2 * kGravity * height);
  const dBodyID ball = world.ball({0, 0, kRadius + height}, kRadius, 1000);
  double speed = 0;
  while (world.depth <= 0) {
    speed = -double(dBodyGetLinearVel(ball)[2]);
    world.step();
  }
  return {{"speed", speed, exact, exact}, {"depth", world.depth, 0, 2 * kRadius}};
}

// A ball that falls, with a restitution of 0.8: how high it comes.
Quantities bounce(const TruthSetting& setting, double phase) {
  World world(setting);
  world.plane();
  world.bounce = 0.8;
  const double height = 1 + 0.1 * phase, exact = 0.64 * height;
  const dBodyID ball = world.ball({0, 0, kRadius + height}, kRadius, 1000);
  const double hits = std::sqrt(2 * height / kGravity), lands = hits * (1 + 2 * world.bounce);
  double top = 0;
  while (world.time < lands - 3 * setting.dt) {
    world.step();
    const double high = double(dBodyGetPosition(ball)[2]) - kRadius;
    if (world.time > hits + 3 * setting.dt) top = std::max(top, high);
  }
  return {{"height", top, exact, exact}};
}

// Two balls of 1:3 of mass head on, with this restitution.
Quantities collide(const TruthSetting& setting, double phase, double restitution) {
  World world(setting, {0, 0, 0});
  world.friction = 0;
  world.bounce = restitution;
  const double m1 = 1, m2 = 3, v1 = 2, v2 = -1, closing = v1 - v2;
  const dBodyID one = world.ball({0, 0, 0}, kRadius, 1000 * m1);
  const dBodyID other = world.ball({1 + 0.1 * phase, 0, 0}, kRadius, 1000 * m2);
  world.push(0, {v1, 0, 0});
  world.push(1, {v2, 0, 0});
  while (world.time < 1) world.step();
  const double mean = (m1 * v1 + m2 * v2) / (m1 + m2);
  const double after1 = mean - m2 / (m1 + m2) * restitution * closing;
  const double after2 = mean + m1 / (m1 + m2) * restitution * closing;
  const double got1 = double(dBodyGetLinearVel(one)[0]), got2 = double(dBodyGetLinearVel(other)[0]);
  return {{"separation", got2 - got1, after2 - after1, closing},
          {"momentum", m1 * got1 + m2 * got2, m1 * v1 + m2 * v2, m2 * closing}};
}

// Of what goes through zero, upwards: the mean of up to five periods.
template <typename Value>
double periodOf(World& world, const Value& value, double most) {
  std::vector<double> crossings;
  while (crossings.size() < 6 && world.time < most) {
    const double before = value();
    world.step();
    const double now = value();
    if (before < 0 && now >= 0) crossings.push_back(world.time - world.dt() * now / (now - before));
  }
  const double turns = std::max(1.0, double(crossings.size()) - 1);
  return crossings.empty() ? 0 : (crossings.back() - crossings.front()) / turns;
}

// The complete elliptic integral of the first kind, by the arithmetic-geometric mean: libc++ has no
// std::comp_ellint_1.
double ellipticK(double k) {
  double a = 1, b = std::sqrt((1 - k) * (1 + k));
  for (int i = 0; i < 8; ++i) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  return kPi / (2 * a);
}

// A ball of 0.1 m on a rod of 1 m without mass: period and energy over five periods.
Quantities pendulum(const TruthSetting& setting, double phase) {
  World world(setting);
  const double radius = 0.1, angle = 1 + 0.1 * phase;
  const dBodyID bob = world.ball({std::sin(angle), 0, -std::cos(angle)}, radius, 1000);
  world.hinge(bob, nullptr, {0, 0, 0}, {0, 1, 0});
  const double m = tradeoff::massOf(bob), inertia = m * (1 + 0.4 * radius * radius);
  const double exact = 4 * std::sqrt(inertia / (m * kGravity)) * ellipticK(std::sin(angle / 2));
  const double start = world.energy(), scale = m * kGravity * (1 - std::cos(angle));
  const double period = periodOf(
      world, [bob] { return double(dBodyGetPosition(bob)[0]); }, 100 * exact);
  return {{"period", period, exact, exact}, {"energy", world.energy(), start, scale}};
}

// A free box about no axis of its own: energy, angular momentum, and the period in which its axes
// go round its angular momentum (Landau, Lifshitz: Mechanics, section 37).
Quantities top(const TruthSetting& setting, double phase) {
  World world(setting, {0, 0, 0});
  const dBodyID box = world.freeBox({1, 0.6, 0.3}, {0, 0, 0});
  const Vec spin = {1 + 0.1 * phase, 0, 3};
  dBodySetAngularVel(box, real(spin[0]), real(spin[1]), real(spin[2]));
  dMass mass;
  dBodyGetMass(box, &mass);
  const double i1 = double(mass.I[0]), i2 = double(mass.I[5]), i3 = double(mass.I[10]);
  const Vec start = tradeoff::spinOf(box);
  const double energy = world.energy(), square = dot(start, start);
  const double k =
      (i2 - i1) * (2 * energy * i3 - square) / ((i3 - i2) * (square - 2 * energy * i1));
  const double exact = 4 * ellipticK(std::sqrt(k)) *
                       std::sqrt(i1 * i2 * i3 / ((i3 - i2) * (square - 2 * energy * i1)));
  const double period = periodOf(
      world, [box] { return World::rate(box)[1]; }, 10 * exact);
  return {{"period", period, exact, exact},
          {"energy", world.energy(), energy, energy},
          {"momentum", length(minus(tradeoff::spinOf(box), start)), 0, std::sqrt(square)}};
}

// A free body that turns about its axis and wobbles: after which time the wobble halves, or doubles
// (negative), and what near ln 2 / (|axial / transverse inertia - 1| rate^2 step) gives.
Quantities wobble(const TruthSetting& setting, const dMass& mass) {
  World world(setting, {0, 0, 0});
  const double rate = 10, ratio = double(mass.I[10] / mass.I[0]);
  world.body(nullptr, mass, {});
  world.spin(0, {0.02 * rate, 0, rate});
  const auto angle = [&world] {
    const Vec w = World::rate(world[0]);
    return std::hypot(w[0], w[1]) / std::fabs(w[2]);
  };
  const double start = angle();
  while (angle() > start / 2 && angle() < start * 2 && world.time < 100) world.step();
  const double time = angle() < start ? world.time : -world.time;
  const double exact = std::log(2.0) / ((ratio - 1) * rate * rate * setting.dt);
  return {{"half-life", time, exact, std::fabs(exact)}};
}

Quantities wobbleOfRound(const TruthSetting& setting, double radius, double length) {
  dMass mass;
  dMassSetCylinder(&mass, 1000, 3, real(radius), real(length));
  return wobble(setting, mass);
}

Quantities wobbleOfBox(const TruthSetting& setting) {
  dMass mass;
  dMassSetBox(&mass, 1000, real(0.4), real(0.4), 1);
  return wobble(setting, mass);
}

// What dJointFeedback says of the floor's contacts from `from` seconds on, in parts of the weight:
// how far it is from the weight on average; and how far a body has sunk.
Quantities forces(World& world, double from, double until, std::size_t body, double unit,
                  const std::function<void()>& drive) {
  std::deque<dJointFeedback> feedback;
  world.joined = [&](dJointID joint) {
    if (dJointGetBody(joint, 1)) return;
    feedback.emplace_back();
    dJointSetFeedback(joint, &feedback.back());
  };
  double weight = 0, off = 0, count = 0;
  for (const dBodyID b : world.bodies()) weight += kGravity * tradeoff::massOf(b);
  const double height = world.place(body)[2];
  while (world.time < until) {
    feedback.clear();
    drive();
    world.step();
    if (world.time < from) continue;
    double sum = 0;
    for (const dJointFeedback& each : feedback) sum += double(each.f1[2]);
    off += std::fabs(sum / weight - 1);
    ++count;
  }
  return {{"force", off / count, 0, 1},
          {"drop", std::fabs(height - world.place(body)[2]), 0, unit}};
}

Quantities stackForces(const TruthSetting& setting, double phase) {
  World world(setting);
  world.friction = 0.8;
  world.plane();
  for (int i = 0; i < 5; ++i) world.box({0.01 * phase * (i % 2), 0, i + 0.5}, {1, 1, 1});
  return forces(world, 2, 4, 4, 1, [] {});
}

Quantities humanoidForces(const TruthSetting& setting, double phase) {
  const Extreme humanoid = machines().back();
  TruthSetting half = setting;
  half.dt /= 2;
  World world(half);
  world.friction = 0.8;
  humanoid.build(world);
  world.push(0, {1e-4 * phase, 0, 0});
  return forces(world, 1, 3, 0, 1, [&] { humanoid.drive(world, 0); });
}

// Ten links of 0.2 m that fall, begun so many degrees above level: energy after two seconds, and
// the widest gap of a joint.
Quantities chain(const TruthSetting& setting, double phase, double degrees) {
  World world(setting);
  const int links = 10;
  const double side = 0.2, tilt = 0.01 * phase - degrees * kPi / 180;
  const Vec way = {std::cos(tilt), 0, -std::sin(tilt)};
  for (int i = 0; i < links; ++i) {
    const dBodyID link = world.freeBox({side, 0.05, 0.05}, side * (i + 0.5) * way);
    dMatrix3 turn;
    dRFromAxisAndAngle(turn, 0, 1, 0, real(tilt));
    dBodySetRotation(link, turn);
    const dBodyID last = i ? world[size_t(i) - 1] : nullptr;
    world.ballJoint(link, last, side * i * way);
  }
  const double start = world.energy(),
               scale = tradeoff::massOf(world[0]) * kGravity * links * links * side / 2;
  double gap = 0;
  while (world.time < 2 - setting.dt / 2) {
    world.step();
    for (dJointID joint : world.joints()) gap = std::max(gap, gapOf(joint));
  }
  return {{"energy", world.energy(), start, scale}, {"gap", gap, 0, side}};
}

// 6 x 6 x 6 balls with a restitution of 1 and no friction, which fall on each other: energy. Sizes
// and masses are those of SimBenchmark's "elastic 666".
Quantities balls(const TruthSetting& setting, double phase) {
  World world(setting);
  world.plane();
  world.friction = 0;
  world.bounce = 1;
  const double radius = 0.1, cell = 0.21, shift = 0.001;
  const double density = 10 / (4 * kPi / 3 * radius * radius * radius);
  for (int i = 0; i < 216; ++i) {
    const auto off = [&](int n) { return shift * std::sin(17 * i + 5 * n + 6 * phase); };
    world.ball({cell * (i % 6) + off(1), cell * (i / 6 % 6) + off(2), 1.101 + cell * (i / 36)},
               radius, density);
  }
  const double start = world.energy();
  while (world.time < 2) world.step();
  return {{"energy", world.energy(), start, start}};
}

// A scene with its parameters, and what it is measured in.
struct Scene {
  const char* name;
  const char* of;
  std::function<Quantities(const TruthSetting&, double phase)> play;
  enum Kind { contact, friction, free, slow } kind;
};

std::vector<Scene> scenes() {
  using std::placeholders::_1;
  using std::placeholders::_2;
  const char* const block = "block 0.5 x 0.5 x 0.1 m, 25 kg, friction 0.6";
  const char* const on_slope = "the block, for 1 s";
  const char* const ball = "ball 0.5 m, 65 kg";
  const char* const links = "10 links 0.2 m, 0.5 kg";
  return {
      {"slide at 0 degrees", block, std::bind(slide, _1, _2, 0), Scene::friction},
      {"slide at 45 degrees", block, std::bind(slide, _1, _2, 45), Scene::friction},
      {"slope below friction", on_slope, std::bind(slope, _1, _2, 0.9, 0), Scene::friction},
      {"slope above friction", on_slope, std::bind(slope, _1, _2, 1.1, 0), Scene::friction},
      {"slope above friction at 45 degrees", on_slope, std::bind(slope, _1, _2, 1.1, 45),
       Scene::friction},
      {"roll at 45 degrees", ball, std::bind(roll, _1, _2, 45), Scene::friction},
      {"fall", "ball 0.5 m, 65 kg, from 1 m", fall, Scene::contact},
      {"bounce", "the ball, restitution 0.8", bounce, Scene::contact},
      {"collide elastically", "balls 0.5 m, 65 and 196 kg", std::bind(collide, _1, _2, 1),
       Scene::contact},
      {"collide inelastically", "the balls", std::bind(collide, _1, _2, 0), Scene::contact},
      {"pendulum", "ball 0.2 m, 4 kg, at 1 m, from 60 degrees", pendulum, Scene::contact},
      {"chain from 6 degrees below level", links, std::bind(chain, _1, _2, -6), Scene::contact},
      {"chain from level", links, std::bind(chain, _1, _2, 0), Scene::contact},
      {"chain from 6 degrees above level", links, std::bind(chain, _1, _2, 6), Scene::contact},
      {"force under a stack", "5 boxes of 1 m, 1,000 kg", stackForces, Scene::slow},
      {"force under a humanoid", "70 kg, feet 1 kg, 5 ms", humanoidForces, Scene::slow},
      {"top", "box, 10 rad/s", top, Scene::free},
      {"wobble of a disc", "0.5 m x 0.05 m, 10 rad/s", std::bind(wobbleOfRound, _1, 0.5, 0.05),
       Scene::free},
      {"wobble of a drum", "0.5 m x 0.5 m, 10 rad/s", std::bind(wobbleOfRound, _1, 0.5, 0.5),
       Scene::free},
      {"wobble of a rod", "0.05 m x 1 m, 10 rad/s", std::bind(wobbleOfRound, _1, 0.05, 1),
       Scene::free},
      {"wobble of a box", "0.4 x 0.4 x 1 m, 10 rad/s", std::bind(wobbleOfBox, _1), Scene::free},
      {"elastic balls", "216 of 0.2 m, 10 kg", balls, Scene::slow},
  };
}

// The means over all streams.
struct Result {
  std::string quantity;
  double value = 0, exact = 0, error = 0, least = 1e300, most = 0;
};

std::vector<Result> resultsOf(const Scene& scene, TruthSetting setting) {
  std::vector<Result> results;
  const unsigned streams = scene.kind == Scene::slow ? 6 : kStreams;
  for (unsigned i = 0; i < streams; ++i) {
    const double golden = 0.618033988749895 * i;  // no step divides these
    setting.start = i + 1;
    const Quantities found = scene.play(setting, golden - std::floor(golden));
    results.resize(found.size());
    for (size_t q = 0; q < found.size(); ++q) {
      const double error = std::fabs(found[q].value - found[q].exact) / found[q].scale;
      Result& result = results[q];
      result.quantity = found[q].name;
      result.value += found[q].value / streams;
      result.exact += found[q].exact / streams;
      result.error += error / streams;
      result.least = std::min(result.least, error);
      result.most = std::max(result.most, error);
    }
  }
  return results;
}

// What is changed of ODE's own: one thing at a time.
std::vector<TruthSetting> settingsOf(const Scene& scene) {
  std::vector<TruthSetting> all(1);
  const auto add = [&all](const char* name) -> TruthSetting& {
    all.emplace_back();
    all.back().name = name;
    return all.back();
  };
  add("1/4 of the step").dt /= 4;
  if (scene.kind != Scene::slow) add("1/16 of the step").dt /= 16;
  if (scene.name != std::string("elastic balls")) add("dWorldStep").exact = true;
  if (scene.kind == Scene::free) return all;
  add("100 iterations").iterations = 100;
  add("ERP 0.8").erp = 0.8;
  add("CFM 1e-5").cfm = 1e-5;
  add("CFM = step / mass").soft = true;
  if (scene.kind == Scene::friction) add("fdir1").directed = true;
  return all;
}

void writeRows(std::ostream& out, const std::string& only) {
  if (only.empty()) out << "scene,of,quantity,setting,dt,us_a_step,value,exact,error,least,most\n";
  out.precision(4);
  for (const Scene& scene : scenes())
    for (const TruthSetting& s : settingsOf(scene)) {
      if (!only.empty() && scene.name != only) continue;
      steps_played = 0;
      const std::clock_t before = std::clock();
      const std::vector<Result> results = resultsOf(scene, s);
      const double cost =
          1e6 * double(std::clock() - before) / CLOCKS_PER_SEC / double(steps_played);
      for (const Result& r : results)
        out << scene.name << ",\"" << scene.of << "\"," << r.quantity << "," << s.name << ","
            << s.dt << "," << cost << "," << r.value << "," << r.exact << "," << r.error << ","
            << r.least << "," << r.most << std::endl;
    }
}

// What an error must be at one setting: steps of 2.5 ms, 50 iterations, CFM 1e-10.
struct Bound {
  const char* scene;
  const char* quantity;
  bool directed;
  double least, most;  // of the error
};

constexpr double kRounding = sizeof(dReal) == 8 ? 1e-9 : 1e-4;

const Bound kBounds[] = {
    {"slide at 0 degrees", "way", false, 0.004, 0.006},
    {"slide at 45 degrees", "way", false, 0.29, 0.305},  // 1 - 1 / sqrt(2), and the step
    {"slide at 45 degrees", "way", true, 0.004, 0.006},
    {"slope below friction", "way", false, 0, 0.001},
    {"slope above friction", "way", false, 0, 0.004},
    {"slope above friction at 45 degrees", "way", false, 0.98, 1.02},  // it does not slide at all
    {"slope above friction at 45 degrees", "way", true, 0, 0.004},
    {"roll at 45 degrees", "speed", false, 0, kRounding},
    {"fall", "speed", false, 0, 0.003},
    {"fall", "depth", false, 0.008, 0.015},  // half of v dt on average, of the ball's 0.5 m
    {"bounce", "height", false, 0, 0.004},
    {"collide elastically", "separation", false, 0, 0.001},
    {"collide elastically", "momentum", false, 0, kRounding},
    {"collide inelastically", "separation", false, 0.08, 0.13},  // ERP / 2 on average
    {"collide inelastically", "momentum", false, 0, kRounding},
    {"pendulum", "period", false, 0, 0.001},
    {"pendulum", "energy", false, 0, 0.005},
    {"top", "period", false, 0, 0.025},
    {"top", "energy", false, 0, 0.015},
    {"top", "momentum", false, 0, 0.006},
    {"chain from level", "energy", false, 0, 0.06},
    {"chain from level", "gap", false, 0, 0.04},
    {"wobble of a disc", "half-life", false, 0.25, 0.4},
    {"wobble of a drum", "half-life", false, 0.15, 0.25},
    {"wobble of a rod", "half-life", false, 0.8, 0.92},
    {"wobble of a box", "half-life", false, 0.5, 0.62},
    {"elastic balls", "energy", false, 0, 0.005},
};

int check() {
  int failures = 0;
  TruthSetting setting;
  setting.dt = 0.0025;
  setting.iterations = 50;
  setting.cfm = 1e-10;
  for (const Scene& scene : scenes())
    for (const Bound& bound : kBounds) {
      if (scene.name != std::string(bound.scene)) continue;
      setting.directed = bound.directed;
      for (const Result& result : resultsOf(scene, setting)) {
        if (result.quantity != bound.quantity) continue;
        const bool holds = result.error >= bound.least && result.error <= bound.most;
        failures += !holds;
        std::printf("%-36s%-11s%-6s off by %10.3g %%, bounds %.3g to %.3g %%%s\n", bound.scene,
                    bound.quantity, bound.directed ? "fdir1" : "", 100 * result.error,
                    100 * bound.least, 100 * bound.most, holds ? "" : "  <-- NOT WITHIN");
      }
    }
  return failures ? 1 : 0;
}

}  // namespace
}  // namespace sap_test::physics

int main(int argc, char** argv) {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "check" && argc == 2) return sap_test::physics::check();
  if (what == "rows" && (argc == 3 || argc == 4)) {
    dSetMessageHandler([](int, const char*, va_list) {});  // of dWorldStep
    std::ofstream file(argv[2], argc == 4 ? std::ios::app : std::ios::out);
    sap_test::physics::writeRows(file, argc == 4 ? argv[3] : "");
    return file.good() ? 0 : 1;
  }
  std::fprintf(stderr, "physics-truth rows ROWS.csv [SCENE], or physics-truth check\n");
  return 2;
}
