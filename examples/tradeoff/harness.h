#ifndef TRADEOFF_HARNESS_H
#define TRADEOFF_HARNESS_H

// What a program gives to have its own scene studied: README.md, "A scene of your own". All is in
// headers: it needs ODE, this library, and nothing else.
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <ctime>
#include <limits>
#include <sstream>

#include "harness/stepper.h"

namespace tradeoff {

// Something that matters in this scene, and how much of it would be an error of 100 %.
struct Observation {
  std::string name;
  double value;
  double scale;
};

struct Scene {
  // Makes bodies, joints and geoms. `seed` decides all chance. Masses are the scene's own: they are
  // part of what is studied.
  std::function<void(dWorldID world, dSpaceID space, unsigned long seed)> build;

  // If there is any: called once it is built, with the time step, for what ODE wants to be told in
  // terms of it, as the ERP and CFM of springs.
  std::function<void(double dt)> prepare;
  // If there is any: called before each step, to drive motors or push bodies. `time` in seconds.
  std::function<void(double time)> control;
  // If there is any: called once, after the last step; with `observe_every` after each so many
  // steps from `observe_from` seconds on, and the mean is what counts.
  std::function<std::vector<Observation>()> observe;
  int observe_every = 0;
  double observe_from = 0;
  // If there is any: sets a contact's surface; no joint is made where it returns false. Otherwise
  // mu is 0.6, and the model of friction the pyramid.
  std::function<bool(dContact& contact)> surface;

  double seconds = 8;     // simulated, in whole steps
  bool rests = true;      // it is at rest in the last second, if all goes well
  bool undriven = false;  // no motor, belt or lift moves it, nor does the program: it may sleep
  // Outcomes that do not matter here, of height, spread, jitter, energy, separated by '+'.
  std::string ignores;
};

namespace harness {

// The scene's units, as it is built.
struct Basis {
  std::vector<dBodyID> bodies;  // those with a geom that forces move, in the order of the space
  Vector up = {0, 0, 1};        // against gravity
  double gravity = 0;           // m/s^2
  double mass = 0;
  double size = 0;   // mean longest extent of the bodies' geoms
  double speed = 1;  // of a fall through half a size, m/s; 1 without gravity
};

inline void collect(dSpaceID space, Basis& basis, std::set<dBodyID>& seen) {
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) {
    const dGeomID geom = dSpaceGetGeom(space, i);
    if (dGeomIsSpace(geom)) {
      collect(reinterpret_cast<dSpaceID>(geom), basis, seen);
      continue;
    }
    const dBodyID body = dGeomGetBody(geom);
    if (!body || dBodyIsKinematic(body) || !seen.insert(body).second) continue;
    dReal box[6];
    dGeomGetAABB(geom, box);
    basis.size +=
        static_cast<double>(std::max({box[1] - box[0], box[3] - box[2], box[5] - box[4]}));
    basis.mass += massOf(body);
    basis.bodies.push_back(body);
  }
}

inline Basis basisOf(dWorldID world, dSpaceID space) {
  Basis basis;
  std::set<dBodyID> seen;
  collect(space, basis, seen);
  if (basis.bodies.empty())
    throw std::invalid_argument("the scene has no body with a geom that moves by forces");
  basis.size /= static_cast<double>(basis.bodies.size());
  const Vector gravity = gravityOf(world);
  basis.gravity = length(gravity);
  if (basis.gravity > 0) {
    for (size_t i = 0; i < 3; ++i) basis.up[i] = -gravity[i] / basis.gravity;
    basis.speed = std::sqrt(basis.gravity * basis.size);
  }
  return basis;
}

// All bodies at one moment.
struct State {
  double energy = 0;        // kinetic and potential
  double height = 0;        // mean of the centres
  double spread = 0;        // from the lowest centre to the highest
  double square_speed = 0;  // mean, of rotation as of a body's ends
};

// Throws std::runtime_error where a body is nowhere.
inline State stateOf(const Basis& basis) {
  State now;
  double highest = -std::numeric_limits<double>::infinity(), lowest = -highest;
  const double count = static_cast<double>(basis.bodies.size());
  for (dBodyID body : basis.bodies) {
    const Vector velocity = vectorOf(dBodyGetLinearVel(body));
    const Vector rate = vectorOf(dBodyGetAngularVel(body));
    const double height = dot(basis.up, vectorOf(dBodyGetPosition(body)));
    now.energy +=
        massOf(body) * (dot(velocity, velocity) / 2 + basis.gravity * height) + spinEnergyOf(body);
    now.height += height / count;
    now.square_speed +=
        (dot(velocity, velocity) + dot(rate, rate) * basis.size * basis.size / 4) / count;
    highest = std::max(highest, height);
    lowest = std::min(lowest, height);
  }
  if (!std::isfinite(now.energy)) throw std::runtime_error("a body is nowhere");
  now.spread = highest - lowest;
  return now;
}

// What a run comes to. Outcomes are in units in which 1 is an error of 100 %.
class Outcomes {
 public:
  Outcomes(const Scene& scene, const Basis& basis)
      : scene_(scene), basis_(basis), start_(stateOf(basis)), energy_(start_.energy) {}

  // To be called after each step, with the time then.
  void add(double time, double dt, size_t step) {
    const State now = stateOf(basis_);
    gain_ += std::max(0.0, now.energy - energy_);
    energy_ = now.energy;
    if (time > scene_.seconds - 1) {
      ++resting_;
      height_ += now.height;
      spread_ += now.spread;
      square_speed_ += now.square_speed;
    }
    if (scene_.observe_every > 0 && step % static_cast<size_t>(scene_.observe_every) == 0 &&
        time > scene_.observe_from - dt / 2)
      observe();
  }

  std::map<std::string, double> all() {
    if (observed_.empty()) observe();
    const double extent = start_.spread + basis_.size;
    std::map<std::string, double> all = {{"height", height_ / resting_ / extent},
                                         {"spread", spread_ / resting_ / extent}};
    if (scene_.rests) all["jitter"] = std::sqrt(square_speed_ / resting_) / basis_.speed;
    if (!scene_.control) all["energy"] = gain_ / (basis_.mass * basis_.speed * basis_.speed);
    std::istringstream ignored(scene_.ignores);
    for (std::string name; std::getline(ignored, name, '+');) all.erase(name);
    for (const auto& [name, sum] : observed_) all[name] = sum.first / sum.second;
    return all;
  }

 private:
  void observe() {
    if (!scene_.observe) return;
    for (const Observation& seen : scene_.observe()) {
      check(seen);
      auto& sum = observed_[seen.name];
      sum.first += seen.value / seen.scale;
      ++sum.second;
    }
  }

  // Its name becomes a column's.
  static void check(const Observation& seen) {
    static const std::set<std::string> known = {"height", "spread", "jitter", "energy"};
    if (known.count(seen.name))
      throw std::invalid_argument("an observation has the name of an outcome of all scenes: " +
                                  seen.name);
    const auto is_plain = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
    if (seen.name.empty() || !std::all_of(seen.name.begin(), seen.name.end(), is_plain))
      throw std::invalid_argument("an observation's name has letters, digits and _ only: " +
                                  seen.name);
    if (!(seen.scale > 0)) throw std::invalid_argument("an observation needs a scale above 0");
  }

  const Scene& scene_;
  const Basis& basis_;
  State start_;
  double energy_, gain_ = 0;
  double resting_ = 0, height_ = 0, spread_ = 0, square_speed_ = 0;  // of the last second
  std::map<std::string, std::pair<double, double>> observed_;        // sum and number of each
};

// Plays the scene once: two lines of CSV, names and values.
inline std::string measure(const Scene& scene, const Settings& settings) {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  const dWorldID world = dWorldCreate();
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  dWorldSetGravity(world, 0, 0, static_cast<dReal>(-9.81));
  scene.build(world, space, settings.seed);
  if (scene.prepare) scene.prepare(settings.dt);
  const Basis basis = basisOf(world, space);
  Stepper stepper(world, space, settings, basis.bodies, scene.surface);
  Outcomes outcomes(scene, basis);
  const auto steps = static_cast<size_t>(std::max(1l, std::lround(scene.seconds / settings.dt)));
  const std::clock_t began =
      std::clock();  // the processor's: what else the machine does is not in it
  for (size_t i = 0; i < steps; ++i) {
    if (scene.control) scene.control(static_cast<double>(i) * settings.dt);
    stepper.step();
    outcomes.add(static_cast<double>(i + 1) * settings.dt, settings.dt, i + 1);
  }
  const double spent = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
  std::ostringstream names, values;
  values.precision(9);
  names << "ms_per_s,undriven";
  values << 1000 * spent / (static_cast<double>(steps) * settings.dt) << ',' << scene.undriven;
  for (const auto& [name, value] : outcomes.all()) {
    names << ",outcome_" << name;
    values << ',' << value;
  }
  dSpaceDestroy(space);
  dWorldDestroy(world);
  dCloseODE();
  return names.str() + "\n" + values.str() + "\n";
}

}  // namespace harness

// The program's main: plays the scene once. Returns the exit code: 1 where a body is nowhere, 2
// where the program or the scene is wrong.
inline int run(int argc, char** argv, const Scene& scene) {
  try {
    std::fputs(harness::measure(scene, parseSettings(argc, argv)).c_str(), stdout);
    return 0;
  } catch (const Help& help) {
    std::printf("%s\n", help.text.c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return dynamic_cast<const std::logic_error*>(&error) ? 2 : 1;
  }
}

}  // namespace tradeoff

#endif
