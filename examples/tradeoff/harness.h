#ifndef TRADEOFF_HARNESS_H
#define TRADEOFF_HARNESS_H

// What a program gives to have its own scene studied: README.md, "A scene of your own".
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <map>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>

#include "harness/vectors.h"

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

  // If there is any: called once it is built, with the time step, as for ERP and CFM of springs.
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

// What the study varies. The values here are ODE's own where it has any.
struct Settings {
  double dt = 0.01;               // seconds
  int iterations = 20;            // of QuickStep
  int contacts = 4;               // most of a pair
  std::string reducer = "first";  // as dCollide gives them; deepest, spread: dParallelSAPKeep*
  double erp = 0.2;               // the part of an error of a joint that one step mends
  double cfm = 1e-10;             // s/kg; negative, "step/mass": step by the lightest body's mass
  std::string solver = "quick";   // dWorldQuickStep; step: dWorldStep
  std::string sleep = "off";      // on: bodies are disabled by ODE's own thresholds
  unsigned long seed = 1;
};

namespace harness {

// Reads "--name value" pairs; throws std::invalid_argument where one is wrong.
inline Settings parseSettings(int argc, char** argv) {
  Settings s;
  std::string text;
  const auto number = [&text](double least, double most) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !(value >= least && value <= most))
      throw std::invalid_argument("no number, or out of range: " + text);
    return value;
  };
  const auto word = [&text](const std::string& known) {  // separated by spaces
    if ((" " + known + " ").find(" " + text + " ") == std::string::npos ||
        text.find(' ') < text.size())
      throw std::invalid_argument("unknown: " + text);
    return text;
  };
  const std::map<std::string, std::function<void()>> setters = {
      {"--dt", [&] { s.dt = number(1e-6, 1); }},
      {"--iterations", [&] { s.iterations = int(number(1, 1e5)); }},
      {"--contacts", [&] { s.contacts = int(number(1, 64)); }},
      {"--reducer", [&] { s.reducer = word("first deepest spread"); }},
      {"--erp", [&] { s.erp = number(0, 1); }},
      {"--cfm", [&] { s.cfm = text == "step/mass" ? -1 : number(0, 1e6); }},
      {"--solver", [&] { s.solver = word("quick step"); }},
      {"--sleep", [&] { s.sleep = word("on off"); }},
      {"--seed", [&] { s.seed = static_cast<unsigned long>(number(0, 1e9)); }}};
  for (int i = 1; i < argc; i += 2) {
    const auto setter = setters.find(argv[i]);
    if (setter == setters.end() || i + 1 == argc)
      throw std::invalid_argument(std::string("no such setting, or no value: ") + argv[i]);
    text = argv[i + 1];
    setter->second();
  }
  return s;
}

// One step after the other with these settings: pairs, contacts, joints, solver. On one thread.
struct Stepper {
  dWorldID world;
  dSpaceID space;
  const Scene& scene;
  const Settings& settings;
  dJointGroupID joints = dJointGroupCreate(0);

  void prepare(const std::vector<dBodyID>& bodies) const {
    double lightest = massOf(bodies.front());
    for (dBodyID body : bodies) {
      dBodySetAutoDisableFlag(body, settings.sleep == "on");
      lightest = std::min(lightest, massOf(body));
    }
    dWorldSetERP(world, dReal(settings.erp));
    dWorldSetCFM(world, dReal(settings.cfm < 0 ? settings.dt / lightest : settings.cfm));
    dWorldSetQuickStepNumIterations(world, settings.iterations);
    dRandSetSeed(settings.seed);  // QuickStep shuffles its rows
    dParallelSAPSpaceSetNumThreads(space, 1);
    dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
  }

  void step() {
    collideIn(space);
    (settings.solver == "step" ? dWorldStep : dWorldQuickStep)(world, dReal(settings.dt));
    dJointGroupEmpty(joints);
  }

  // Pairs within each space; near() goes into those between two of them.
  void collideIn(dSpaceID of) {
    dSpaceCollide(of, this, near);
    for (int i = 0; i < dSpaceGetNumGeoms(of); ++i)
      if (dGeomIsSpace(dSpaceGetGeom(of, i)))
        collideIn(reinterpret_cast<dSpaceID>(dSpaceGetGeom(of, i)));
  }

  static void near(void* data, dGeomID first, dGeomID second) {
    if (dGeomIsSpace(first) || dGeomIsSpace(second))
      dSpaceCollide2(first, second, data, near);
    else
      static_cast<Stepper*>(data)->collide(first, second);
  }

  void collide(dGeomID first, dGeomID second) {
    const dBodyID a = dGeomGetBody(first), b = dGeomGetBody(second);
    if (!a && !b) return;
    if (a && b && dAreConnectedExcluding(a, b, dJointTypeContact)) return;
    constexpr int all = 64;
    const int most = settings.contacts;
    const bool reduces = settings.reducer != "first";
    dContactGeom found[all];
    int count = dCollide(first, second, reduces ? all : most, found, sizeof(dContactGeom));
    if (reduces)
      count = (settings.reducer == "deepest" ? dParallelSAPKeepDeepest : dParallelSAPKeepSpread)(
          found, count, most);
    for (int i = 0; i < count; ++i) {
      dContact contact = {};
      contact.geom = found[i];
      contact.surface.mode = dContactApprox1;
      contact.surface.mu = dReal(0.6);
      if (!scene.surface || scene.surface(contact))
        dJointAttach(dJointCreateContact(world, joints, &contact), a, b);
    }
  }
};

// What a run comes to. Outcomes are in units in which 1 is an error of 100 %.
class Outcomes {
 public:
  Outcomes(const Scene& scene, dWorldID world, dSpaceID space)
      : scene_(scene), down_(gravityOf(world)), gravity_(length(down_)) {
    collect(space);
    if (bodies_.empty())
      throw std::invalid_argument("the scene has no body with a geom that moves by forces");
    size_ /= double(bodies_.size());
    if (gravity_ > 0) speed_ = std::sqrt(gravity_ * size_);
    const State start = state();
    energy_ = start.energy;
    extent_ = start.spread + size_;
  }

  // Those that forces move and that have a geom, in the order of the space.
  const std::vector<dBodyID>& bodies() const { return bodies_; }

  // To be called after each step, with their number; throws where a body is nowhere.
  void add(size_t step, double dt) {
    const State now = state();
    const double time = (double(step) + 0.5) * dt;
    gain_ += std::max(0.0, now.energy - energy_);
    energy_ = now.energy;
    if (time > scene_.seconds - 1 + dt) {
      ++count_;
      height_ += now.height;
      spread_ += now.spread;
      square_speed_ += now.square_speed;
    }
    if (scene_.observe_every > 0 && step % static_cast<size_t>(scene_.observe_every) == 0 &&
        time > scene_.observe_from)
      observe();
  }

  std::map<std::string, double> all() {
    if (observed_.empty()) observe();
    std::map<std::string, double> all = {{"height", height_ / count_ / extent_},
                                         {"spread", spread_ / count_ / extent_}};
    if (scene_.rests) all["jitter"] = std::sqrt(square_speed_ / count_) / speed_;
    if (!scene_.control) all["energy"] = gain_ / (mass_ * speed_ * speed_);
    const std::regex is_word("\\w+");
    for (const auto& [name, sum] : observed_)
      if (!std::regex_match(name, is_word) || !all.emplace(name, sum.first / sum.second).second)
        throw std::invalid_argument("no name of an observation, or another outcome's: " + name);
    std::istringstream ignored(scene_.ignores);
    for (std::string name; std::getline(ignored, name, '+');) all.erase(name);
    return all;
  }

 private:
  void collect(dSpaceID space) {
    for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) {
      const dGeomID geom = dSpaceGetGeom(space, i);
      if (dGeomIsSpace(geom)) collect(reinterpret_cast<dSpaceID>(geom));
      const dBodyID body = dGeomIsSpace(geom) ? nullptr : dGeomGetBody(geom);
      if (!body || dBodyIsKinematic(body) ||
          std::find(bodies_.begin(), bodies_.end(), body) != bodies_.end())
        continue;
      dReal box[6];
      dGeomGetAABB(geom, box);
      size_ += double(std::max({box[1] - box[0], box[3] - box[2], box[5] - box[4]}));
      mass_ += massOf(body);
      bodies_.push_back(body);
    }
  }

  // All bodies at one moment.
  struct State {
    double energy = 0;        // kinetic and potential
    double height = 0;        // mean of the centres, against gravity
    double spread = 0;        // from the lowest centre to the highest
    double square_speed = 0;  // mean, of rotation as of a body's ends
  };

  State state() const {
    State now;
    double highest = -dInfinity, lowest = dInfinity;
    const double count = double(bodies_.size());
    for (dBodyID body : bodies_) {
      const Vector place = vectorOf(dBodyGetPosition(body));
      const Vector velocity = vectorOf(dBodyGetLinearVel(body));
      const Vector rate = vectorOf(dBodyGetAngularVel(body));
      const double height = gravity_ > 0 ? -dot(down_, place) / gravity_ : place[2];
      const double square = dot(velocity, velocity);
      now.energy += massOf(body) * (square / 2 + gravity_ * height) + spinEnergyOf(body);
      now.height += height / count;
      now.square_speed += (square + dot(rate, rate) * size_ * size_ / 4) / count;
      highest = std::max(highest, height);
      lowest = std::min(lowest, height);
    }
    if (!std::isfinite(now.energy)) throw std::runtime_error("a body is nowhere");
    now.spread = highest - lowest;
    return now;
  }

  void observe() {
    if (!scene_.observe) return;
    for (const Observation& seen : scene_.observe()) {
      if (!(seen.scale > 0)) throw std::invalid_argument("no scale above 0: " + seen.name);
      observed_[seen.name].first += seen.value / seen.scale;
      ++observed_[seen.name].second;
    }
  }

  const Scene& scene_;
  Vector down_;
  double gravity_;  // m/s^2
  std::vector<dBodyID> bodies_;
  double size_ = 0;    // mean longest side of the bodies' boxes, as the scene is built
  double extent_ = 0;  // of the whole scene then, upwards
  double speed_ = 1;   // of a fall through half a size; 1 without gravity
  double mass_ = 0, energy_ = 0, gain_ = 0;
  double count_ = 0, height_ = 0, spread_ = 0, square_speed_ = 0;  // sums of the last second
  std::map<std::string, std::pair<double, double>> observed_;      // sum and number of each
};

// Plays the scene once: the row, by columns.
inline std::map<std::string, double> measure(const Scene& scene, const Settings& settings) {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  const dWorldID world = dWorldCreate();
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  dWorldSetGravity(world, 0, 0, dReal(-9.81));
  scene.build(world, space, settings.seed);
  if (scene.prepare) scene.prepare(settings.dt);
  Outcomes outcomes(scene, world, space);
  Stepper stepper = {world, space, scene, settings};
  stepper.prepare(outcomes.bodies());
  const auto steps = static_cast<size_t>(std::max(1l, std::lround(scene.seconds / settings.dt)));
  const std::clock_t began = std::clock();  // the processor's time, not the clock's
  for (size_t i = 0; i < steps; ++i) {
    if (scene.control) scene.control(double(i) * settings.dt);
    stepper.step();
    outcomes.add(i + 1, settings.dt);
  }
  const double spent = 1000 * double(std::clock() - began) / CLOCKS_PER_SEC;
  std::map<std::string, double> row = {{"ms_per_s", spent / (double(steps) * settings.dt)},
                                       {"undriven", scene.undriven}};
  for (const auto& [name, value] : outcomes.all()) row["outcome_" + name] = value;
  dJointGroupDestroy(stepper.joints);
  dSpaceDestroy(space);
  dWorldDestroy(world);
  dCloseODE();
  return row;
}

}  // namespace harness

// The program's main: plays the scene once, and prints the row. Returns the exit code: 1 where a
// body is nowhere, 2 where the program or the scene is wrong.
inline int run(int argc, char** argv, const Scene& scene) {
  try {
    if (argc > 1 && (std::string(argv[1]) == "--help" || std::string(argv[1]) == "-h"))
      return std::puts("Plays its scene once. Settings as --dt 0.005: see harness.h") < 0;
    for (const auto& [name, value] : harness::measure(scene, harness::parseSettings(argc, argv)))
      std::printf("%s %.9g\n", name.c_str(), value);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return dynamic_cast<const std::logic_error*>(&error) ? 2 : 1;
  }
}

}  // namespace tradeoff

#endif
