#ifndef TRADEOFF_HARNESS_STEPPER_H
#define TRADEOFF_HARNESS_STEPPER_H

#include <ode_parallel_sap/parallel_sap_space.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "vectors.h"

namespace tradeoff {

// What the study varies. The values here are ODE's own where it has any.
struct Settings {
  double dt = 0.01;     // seconds
  int iterations = 20;  // of QuickStep
  int contacts = 4;     // most of a pair
  std::string reducer =
      "first";         // first: as dCollide gives them; deepest, spread: dParallelSAPKeep*
  double erp = 0.2;    // the part of an error of a joint that one step mends
  double cfm = 1e-10;  // how far constraints give, s/kg; negative: step / mass of the lightest body
  std::string solver = "quick";  // quick: dWorldQuickStep, step: dWorldStep
  std::string sleep = "off";     // on: bodies are disabled by ODE's own thresholds
  unsigned long seed = 1;
};

// Thrown for --help: how the program is called.
struct Help {
  std::string text;
};

// Reads "--name value" pairs; throws std::invalid_argument where one is wrong, Help where it is
// asked for.
inline Settings parseSettings(int argc, char** argv) {
  Settings s;
  const auto number = [](auto& value, double least, double most) {
    return [&value, least, most](const std::string& text) {
      char* end = nullptr;
      const double read = std::strtod(text.c_str(), &end);
      if (text.empty() || *end != '\0') throw std::invalid_argument("no number: " + text);
      if (!(read >= least && read <= most)) throw std::invalid_argument("out of range: " + text);
      value = static_cast<std::decay_t<decltype(value)>>(read);
    };
  };
  const auto word = [](std::string& value, const std::set<std::string>& known) {
    return [&value, known](const std::string& text) {
      if (!known.count(text)) throw std::invalid_argument("unknown: " + text);
      value = text;
    };
  };
  const auto cfm = [&s, read = number(s.cfm, 0, 1e6)](const std::string& text) {
    text == "step/mass" ? void(s.cfm = -1) : read(text);
  };
  const std::map<std::string, std::function<void(const std::string&)>> setters = {
      {"--dt", number(s.dt, 1e-6, 1)},
      {"--iterations", number(s.iterations, 1, 1e5)},
      {"--contacts", number(s.contacts, 1, 64)},
      {"--reducer", word(s.reducer, {"first", "deepest", "spread"})},
      {"--erp", number(s.erp, 0, 1)},
      {"--cfm", cfm},
      {"--solver", word(s.solver, {"quick", "step"})},
      {"--sleep", word(s.sleep, {"on", "off"})},
      {"--seed", number(s.seed, 0, 1e9)}};
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--help" || name == "-h") {
      std::string text = "Measures its scene once and prints a row. Settings, each with a value:";
      for (const auto& known : setters) text += " " + known.first;
      throw Help{text};
    }
    const auto setter = setters.find(name);
    if (setter == setters.end()) throw std::invalid_argument("no such setting: " + name);
    if (i + 1 == argc) throw std::invalid_argument(std::string(argv[i]) + " needs a value");
    setter->second(argv[i + 1]);
  }
  return s;
}

// Time of the steps, by the processor: what else the machine does is not in it. The processor is
// asked once, and what it took is divided as the clock says, since asking it is a system call that
// some sandboxes take long for.
class Spent {
 public:
  Spent() : began_(Clock::now()), processor_began_(processor()) {}

  void start() { step_began_ = Clock::now(); }
  void stop() { wall_ += seconds(Clock::now() - step_began_); }

  double cpu() const {
    const double all = seconds(Clock::now() - began_);
    return all > 0 ? (processor() - processor_began_) * std::min(1.0, wall_ / all) : 0;
  }

 private:
  using Clock = std::chrono::steady_clock;

  static double seconds(Clock::duration time) {
    return std::chrono::duration<double>(time).count();
  }
  static double processor() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

  double wall_ = 0;
  Clock::time_point began_, step_began_;
  double processor_began_;
};

// One step after the other with these settings: pairs, contacts, joints, solver. On one thread.
class Stepper {
 public:
  using Surface = std::function<bool(dContact&)>;

  Stepper(dWorldID world, dSpaceID space, const Settings& settings, const Surface& surface)
      : world_(world),
        space_(space),
        settings_(settings),
        surface_(surface),
        joints_(dJointGroupCreate(0)) {
    dWorldSetERP(world, static_cast<dReal>(settings.erp));
    dWorldSetCFM(world, static_cast<dReal>(settings.cfm));
    dWorldSetQuickStepNumIterations(world, settings.iterations);
    dRandSetSeed(settings.seed);  // QuickStep shuffles its rows
  }
  ~Stepper() { dJointGroupDestroy(joints_); }
  Stepper(const Stepper&) = delete;
  Stepper& operator=(const Stepper&) = delete;

  // `deepest` becomes the depth of the deepest contact, if that is more.
  void step(double& deepest) {
    deepest_ = &deepest;
    spent.start();
    collideIn(space_);
    const dReal dt = static_cast<dReal>(settings_.dt);
    settings_.solver == "step" ? dWorldStep(world_, dt) : dWorldQuickStep(world_, dt);
    dJointGroupEmpty(joints_);
    spent.stop();
  }

  Spent spent;

 private:
  static constexpr int most_found = 64;

  // Pairs within each space; near() goes into those between two of them.
  void collideIn(dSpaceID space) {
    dSpaceCollide(space, this, near);
    for (int i = 0; i < dSpaceGetNumGeoms(space); ++i)
      if (dGeomIsSpace(dSpaceGetGeom(space, i)))
        collideIn(reinterpret_cast<dSpaceID>(dSpaceGetGeom(space, i)));
  }

  static void near(void* data, dGeomID first, dGeomID second) {
    auto& self = *static_cast<Stepper*>(data);
    if (dGeomIsSpace(first) || dGeomIsSpace(second)) {
      dSpaceCollide2(first, second, data, near);
      return;
    }
    self.collide(first, second);
  }

  void collide(dGeomID first, dGeomID second) {
    const dBodyID a = dGeomGetBody(first), b = dGeomGetBody(second);
    if (!a && !b) return;
    if (a && b && dAreConnectedExcluding(a, b, dJointTypeContact)) return;
    dContactGeom found[most_found];
    const bool reduces = settings_.reducer != "first";
    int count = dCollide(first, second, reduces ? most_found : settings_.contacts, found,
                         sizeof(dContactGeom));
    // Geoms that go through each other as they should have no depth.
    count = static_cast<int>(
        std::remove_if(found, found + count,
                       [this](const dContactGeom& geom) { return !wanted(geom); }) -
        found);
    if (count == 0) return;
    for (int i = 0; i < count; ++i)
      *deepest_ = std::max(*deepest_, static_cast<double>(found[i].depth));
    if (settings_.reducer == "deepest")
      count = dParallelSAPKeepDeepest(found, count, settings_.contacts);
    if (settings_.reducer == "spread")
      count = dParallelSAPKeepSpread(found, count, settings_.contacts);
    for (int i = 0; i < count; ++i)
      if (const auto contact = wanted(found[i]))
        dJointAttach(dJointCreateContact(world_, joints_, &*contact), a, b);
  }

  // The contact with its surface; nothing where the scene does not want it.
  std::optional<dContact> wanted(const dContactGeom& geom) const {
    dContact contact = {};
    contact.geom = geom;
    contact.surface.mode = dContactApprox1;
    contact.surface.mu = static_cast<dReal>(0.6);
    if (surface_ && !surface_(contact)) return {};
    return contact;
  }

  dWorldID world_;
  dSpaceID space_;
  const Settings& settings_;
  const Surface& surface_;
  dJointGroupID joints_;
  double* deepest_ = nullptr;
};

}  // namespace tradeoff

#endif
