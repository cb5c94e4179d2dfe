#ifndef TRADEOFF_HARNESS_H
#define TRADEOFF_HARNESS_H

// What a program gives to have its own scene studied: README.md, "A scene of your own". All is in
// headers: it needs ODE, this library, and nothing else.
#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <vector>

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
  // If there is any: whether a body is where it should never be, besides beyond planes and nowhere.
  std::function<bool(dBodyID body)> lost;

  double seconds = 8;     // simulated at most
  bool rests = true;      // it comes to rest, if all goes well
  bool undriven = false;  // no motor, belt or lift moves it, nor does the program: it may sleep
  bool stands = false;    // its highest body stays up, if all goes well
  // Outcomes that do not matter here, of height, spread, jitter, drift, energy, separated by '+'.
  std::string ignores;
};

namespace harness {

// What is fixed of a scene once it is built.
struct Basis {
  std::vector<dBodyID> bodies;  // those with a geom that forces move, in the order of the space
  std::vector<dGeomID> planes;  // without a body
  Vector up = {0, 0, 1};        // against gravity
  double gravity = 0;           // m/s^2
  double mass = 0;
  double size = 1;        // mean longest extent of the bodies' geoms, at the start
  double speed = 1;       // of a fall through half a size, m/s; 1 without gravity
  dBodyID top = nullptr;  // the highest body at the start
};

inline void collect(dSpaceID space, Basis& basis, std::set<dBodyID>& seen, double& extents) {
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) {
    const dGeomID geom = dSpaceGetGeom(space, i);
    if (dGeomIsSpace(geom)) {
      collect(reinterpret_cast<dSpaceID>(geom), basis, seen, extents);
      continue;
    }
    const dBodyID body = dGeomGetBody(geom);
    if (!body && dGeomGetClass(geom) == dPlaneClass) basis.planes.push_back(geom);
    if (!body || dBodyIsKinematic(body) || !seen.insert(body).second) continue;
    dReal box[6];
    dGeomGetAABB(geom, box);
    extents += static_cast<double>(std::max({box[1] - box[0], box[3] - box[2], box[5] - box[4]}));
    basis.bodies.push_back(body);
  }
}

inline Basis basisOf(dWorldID world, dSpaceID space) {
  Basis basis;
  std::set<dBodyID> seen;
  double extents = 0;
  collect(space, basis, seen, extents);
  const Vector gravity = gravityOf(world);
  basis.gravity = length(gravity);
  if (basis.gravity > 0)
    for (size_t i = 0; i < 3; ++i) basis.up[i] = -gravity[i] / basis.gravity;
  if (basis.bodies.empty()) return basis;
  basis.size = extents / static_cast<double>(basis.bodies.size());
  basis.speed = basis.gravity > 0 ? std::sqrt(basis.gravity * basis.size) : 1;
  double highest = -std::numeric_limits<double>::infinity();
  for (dBodyID body : basis.bodies) {
    basis.mass += massOf(body);
    const double height = dot(basis.up, vectorOf(dBodyGetPosition(body)));
    if (height > highest) basis.top = body;
    highest = std::max(highest, height);
  }
  return basis;
}

// All bodies at one moment; those without a finite place are only counted.
struct State {
  double energy = 0;  // kinetic and potential
  double height = 0;  // mean of the centres
  double highest = -std::numeric_limits<double>::infinity();
  double lowest = std::numeric_limits<double>::infinity();
  double square_speed = 0;  // mean, of rotation as of a body's ends
  double fastest = 0;
  size_t not_finite = 0;
};

inline State stateOf(const Basis& basis) {
  State now;
  double count = 0;
  for (dBodyID body : basis.bodies) {
    const Vector place = vectorOf(dBodyGetPosition(body));
    const Vector velocity = vectorOf(dBodyGetLinearVel(body));
    const Vector rate = vectorOf(dBodyGetAngularVel(body));
    const double height = dot(basis.up, place);
    const double square = dot(velocity, velocity) + dot(rate, rate) * basis.size * basis.size / 4;
    if (!std::isfinite(dot(place, place) + square)) {
      ++now.not_finite;
      continue;
    }
    now.energy += massOf(body) * (dot(velocity, velocity) / 2 + basis.gravity * height) +
                  dot(rate, spinOf(body)) / 2;
    now.height += height;
    now.highest = std::max(now.highest, height);
    now.lowest = std::min(now.lowest, height);
    now.square_speed += square;
    now.fastest = std::max(now.fastest, std::sqrt(square));
    ++count;
  }
  now.height /= std::max(count, 1.0);
  now.square_speed /= std::max(count, 1.0);
  return now;
}

// Whether the heap is at rest: nothing went further than this part of its usual speed while it was
// looked away for a moment. Speeds themselves would not do: jitter is fast and goes nowhere.
class Rest {
 public:
  static constexpr double look_every = 0.5;  // simulated seconds
  static constexpr double slow = 0.005;      // of Basis::speed

  explicit Rest(const Basis& basis) : basis_(basis) { remember(); }

  // To be called after each step; true once nothing moved between two looks.
  bool look(double time) {
    if (time - looked_ < look_every) return false;
    double furthest = 0;
    for (size_t i = 0; i < basis_.bodies.size(); ++i)
      furthest = std::max(furthest,
                          length(minus(vectorOf(dBodyGetPosition(basis_.bodies[i])), places_[i])));
    const bool still = furthest <= slow * basis_.speed * (time - looked_);
    looked_ = time;
    remember();
    return still;
  }

 private:
  void remember() {
    places_.clear();
    for (dBodyID body : basis_.bodies) places_.push_back(vectorOf(dBodyGetPosition(body)));
  }

  const Basis& basis_;
  std::vector<Vector> places_;
  double looked_ = 0;
};

// What one point measured, as two lines of CSV: names and values.
class Row {
 public:
  template <typename Value>
  void add(const std::string& name, const Value& value) {
    const char* const separator = names_.empty() ? "" : ",";
    names_ += separator + name;
    values_.precision(9);
    values_ << separator << value;
  }

  std::string text() const { return names_ + "\n" + values_.str() + "\n"; }

 private:
  std::string names_;
  std::ostringstream values_;
};

constexpr double rest_seconds = 1;  // simulated, in which the scene counts as at rest

// What is summed up while steps are taken, apart before the rest and in it.
struct Sums {
  double deepest = 0;  // of a contact, metres
  double rises = 0;    // of the energy
  double height = 0;
  double spread = 0;
  double square_speed = 0;
  double fastest = 0;
  double energy = 0;  // at the end
  size_t steps = 0;

  void add(const State& now, double rise) {
    rises += rise;
    height += now.height;
    spread += now.highest - now.lowest;
    square_speed += now.square_speed;
    fastest = std::max(fastest, now.fastest);
    energy = now.energy;
    ++steps;
  }
};

inline void applyTo(dSpaceID space, const Settings& settings, const Basis& basis) {
  dParallelSAPSpaceSetNumThreads(space, 1);
  dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
  double lightest = std::numeric_limits<double>::infinity();
  for (dBodyID body : basis.bodies) {
    dBodySetAutoDisableFlag(body, settings.sleep == "on");
    lightest = std::min(lightest, massOf(body));
  }
  if (settings.cfm < 0)
    dWorldSetCFM(dBodyGetWorld(basis.top), static_cast<dReal>(settings.dt / lightest));
}

// Bodies nowhere, beyond a plane, or where the scene says that none should be.
inline size_t lostOf(const Scene& scene, const Basis& basis) {
  size_t count = 0;
  for (dBodyID body : basis.bodies) {
    const Vector place = vectorOf(dBodyGetPosition(body));
    bool lost = !std::isfinite(dot(place, place)) || (scene.lost && scene.lost(body));
    for (dGeomID plane : basis.planes) {
      dVector4 p;
      dGeomPlaneGetParams(plane, p);
      lost = lost || dot(vectorOf(p), place) < static_cast<double>(p[3]);
    }
    count += lost;
  }
  return count;
}

// A run: falls until it is at rest or the time is up but for the last second, then one second more.
class Trial {
 public:
  Trial(const Scene& scene, const Settings& settings, dWorldID world, dSpaceID space)
      : scene_(scene),
        settings_(settings),
        basis_(basisOf(world, space)),
        stepper_(world, space, settings, scene.surface),
        start_(stateOf(basis_)) {
    if (basis_.bodies.empty())
      throw std::runtime_error("the scene has no body with a geom that moves by forces");
    top_ = vectorOf(dBodyGetPosition(basis_.top));
    applyTo(space, settings, basis_);
  }

  Row run() {
    Rest rest(basis_);
    double energy = start_.energy;
    // A scene that does not rest is measured over all of its time but the last second, and then.
    bool falls = true;
    double until = scene_.seconds;
    while (time_ < until - settings_.dt / 2) {
      if (scene_.control) scene_.control(time_);
      Sums& sums = falls ? falling_ : resting_;
      stepper_.step(sums.deepest);
      time_ = static_cast<double>(++steps_) * settings_.dt;
      last_ = stateOf(basis_);
      sums.add(last_, std::max(0.0, last_.energy - energy));
      energy = last_.energy;
      if (last_.not_finite) break;
      if (scene_.observe_every > 0 && steps_ % static_cast<size_t>(scene_.observe_every) == 0 &&
          time_ >= scene_.observe_from)
        observe();
      if (falls) {
        rested_ = scene_.rests && rest.look(time_);
        falls = !rested_ && time_ < scene_.seconds - rest_seconds;
        if (!falls) until = time_ + rest_seconds;
      }
    }
    if (observed_.empty()) observe();
    return row();
  }

 private:
  void observe() {
    if (!scene_.observe) return;
    for (const Observation& seen : scene_.observe()) {
      auto& sum = observed_[checked(seen).name];
      sum.first += seen.value / seen.scale;
      ++sum.second;
    }
  }

  Row row() const {
    const double weight = basis_.mass * basis_.speed * basis_.speed;  // lifts all by one size
    const double steps = static_cast<double>(std::max<size_t>(resting_.steps, 1));
    const Vector moved = minus(vectorOf(dBodyGetPosition(basis_.top)), top_);
    const Vector along = minus(moved, scaled(basis_.up, dot(moved, basis_.up)));
    Row row;
    row.add("cpu_s_per_s", stepper_.spent.cpu() / time_);
    row.add("simulated_s", time_);
    row.add("bodies_seen", basis_.bodies.size());
    row.add("size_m", basis_.size);
    row.add("rests", scene_.rests ? 1 : 0);
    row.add("stands", scene_.stands ? 1 : 0);
    row.add("controlled", scene_.control ? 1 : 0);
    row.add("undriven", scene_.undriven ? 1 : 0);
    row.add("ignores", scene_.ignores);
    row.add("rested", rested_ ? 1 : 0);
    row.add("lost", lostOf(scene_, basis_));
    row.add("collapsed", scene_.stands && topSinks(moved) ? 1 : 0);
    row.add("height_m", resting_.height / steps);
    row.add("spread_m", resting_.spread / steps + basis_.size);
    row.add("top_drift_m", length(along));
    row.add("depth_mm", 1000 * resting_.deepest);
    row.add("impact_mm", 1000 * falling_.deepest);
    row.add("fastest_m_s", std::max(falling_.fastest, resting_.fastest));
    row.add("jitter", std::sqrt(resting_.square_speed / steps) / basis_.speed);
    row.add("energy_gain", (falling_.rises + resting_.rises) / weight);
    row.add("energy_drift", (resting_.energy - falling_.energy) / weight / rest_seconds);
    char digest[20];  // settings that give the same are one setting
    std::snprintf(digest, sizeof digest, "x%016llx",
                  static_cast<unsigned long long>(digestOf(basis_.bodies)));
    row.add("digest", digest);
    for (const auto& [name, sum] : observed_)
      row.add("observed_" + name, sum.first / static_cast<double>(sum.second));
    return row;
  }

  // Its name becomes a column's.
  static const Observation& checked(const Observation& seen) {
    static const std::set<std::string> known = {"height", "spread", "jitter", "energy", "drift"};
    if (known.count(seen.name))
      throw std::invalid_argument("an observation has the name of an outcome of all scenes: " +
                                  seen.name);
    for (char letter : seen.name)
      if (!std::isalnum(static_cast<unsigned char>(letter)) && letter != '_')
        throw std::invalid_argument("an observation's name has letters, digits and _ only: " +
                                    seen.name);
    if (seen.name.empty() || !(seen.scale > 0))
      throw std::invalid_argument("an observation needs a name and a scale above 0");
    return seen;
  }

  bool topSinks(const Vector& moved) const { return !(dot(moved, basis_.up) > -basis_.size / 2); }
  static Vector scaled(Vector v, double factor) {
    for (double& x : v) x *= factor;
    return v;
  }

  const Scene& scene_;
  const Settings& settings_;
  Basis basis_;
  Stepper stepper_;
  State start_;
  State last_;
  Vector top_ = {0, 0, 0};
  Sums falling_;
  Sums resting_;
  std::map<std::string, std::pair<double, size_t>> observed_;  // sum and number of each
  double time_ = 0;
  size_t steps_ = 0;
  bool rested_ = false;
};

inline std::string measure(const Scene& scene, const Settings& settings) {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  const dWorldID world = dWorldCreate();
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  dWorldSetGravity(world, 0, 0, static_cast<dReal>(-9.81));
  scene.build(world, space, settings.seed);
  if (scene.prepare) scene.prepare(settings.dt);
  const std::string text = Trial(scene, settings, world, space).run().text();
  dSpaceDestroy(space);
  dWorldDestroy(world);
  dCloseODE();
  return text;
}

}  // namespace harness

// The program's main: measures one point. Returns the exit code: 2 where it was called wrongly.
inline int run(int argc, char** argv, const Scene& scene) {
  try {
    std::fputs(harness::measure(scene, parseSettings(argc, argv)).c_str(), stdout);
    return 0;
  } catch (const Help& help) {
    std::printf("%s\n", help.text.c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 2;
  }
}

}  // namespace tradeoff

#endif
