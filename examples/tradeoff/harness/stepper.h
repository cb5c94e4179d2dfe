#ifndef TRADEOFF_HARNESS_STEPPER_H
#define TRADEOFF_HARNESS_STEPPER_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
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
  double dt = 0.01;               // seconds
  int iterations = 20;            // of QuickStep
  int contacts = 4;               // most of a pair
  std::string reducer = "first";  // as dCollide gives them; deepest, spread: dParallelSAPKeep*
  double erp = 0.2;               // the part of an error of a joint that one step mends
  std::string cfm = "1e-10";      // s/kg; step/mass: of the lightest body
  std::string solver = "quick";   // dWorldQuickStep; step: dWorldStep
  std::string sleep = "off";      // on: bodies are disabled by ODE's own thresholds
  unsigned long seed = 1;
};

// Thrown for --help: how the program is called.
struct Help {
  std::string text;
};

inline double numberIn(const std::string& text, double least, double most) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(number >= least && number <= most))
    throw std::invalid_argument("no number, or out of range: " + text);
  return number;
}

// Reads "--name value" pairs; throws std::invalid_argument where one is wrong, Help where it is
// asked for.
inline Settings parseSettings(int argc, char** argv) {
  using Set = std::function<void(const std::string&)>;
  Settings s;
  const auto number = [](auto& value, double least, double most) -> Set {
    return [&value, least, most](const std::string& text) {
      value = static_cast<std::decay_t<decltype(value)>>(numberIn(text, least, most));
    };
  };
  const auto word = [](std::string& value, const std::set<std::string>& known) -> Set {
    return [&value, known](const std::string& text) {
      if (!known.count(text)) throw std::invalid_argument("unknown: " + text);
      value = text;
    };
  };
  const std::map<std::string, Set> setters = {
      {"--dt", number(s.dt, 1e-6, 1)},
      {"--iterations", number(s.iterations, 1, 1e5)},
      {"--contacts", number(s.contacts, 1, 64)},
      {"--reducer", word(s.reducer, {"first", "deepest", "spread"})},
      {"--erp", number(s.erp, 0, 1)},
      {"--cfm",
       [&s](const std::string& text) {
         if (text != "step/mass") numberIn(text, 0, 1e6);
         s.cfm = text;
       }},
      {"--solver", word(s.solver, {"quick", "step"})},
      {"--sleep", word(s.sleep, {"on", "off"})},
      {"--seed", number(s.seed, 0, 1e9)}};
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--help" || name == "-h") {
      std::string text = "Plays its scene once and prints a row. Settings, each with a value:";
      for (const auto& known : setters) text += " " + known.first;
      throw Help{text};
    }
    const auto setter = setters.find(name);
    if (setter == setters.end()) throw std::invalid_argument("no such setting: " + name);
    if (i + 1 == argc) throw std::invalid_argument(name + " needs a value");
    setter->second(argv[i + 1]);
  }
  return s;
}

// One step after the other with these settings: pairs, contacts, joints, solver. On one thread.
class Stepper {
 public:
  using Surface = std::function<bool(dContact&)>;

  Stepper(dWorldID world, dSpaceID space, const Settings& settings,
          const std::vector<dBodyID>& bodies, const Surface& surface)
      : world_(world),
        space_(space),
        settings_(settings),
        surface_(surface),
        joints_(dJointGroupCreate(0)) {
    double lightest = massOf(bodies.front());
    for (dBodyID body : bodies) {
      dBodySetAutoDisableFlag(body, settings.sleep == "on");
      lightest = std::min(lightest, massOf(body));
    }
    dWorldSetERP(world, static_cast<dReal>(settings.erp));
    dWorldSetCFM(world,
                 static_cast<dReal>(settings.cfm == "step/mass" ? settings.dt / lightest
                                                                : numberIn(settings.cfm, 0, 1e6)));
    dWorldSetQuickStepNumIterations(world, settings.iterations);
    dRandSetSeed(settings.seed);  // QuickStep shuffles its rows
    dParallelSAPSpaceSetNumThreads(space, 1);
    dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
  }
  ~Stepper() { dJointGroupDestroy(joints_); }
  Stepper(const Stepper&) = delete;
  Stepper& operator=(const Stepper&) = delete;

  void step() {
    collideIn(space_);
    const dReal dt = static_cast<dReal>(settings_.dt);
    settings_.solver == "step" ? dWorldStep(world_, dt) : dWorldQuickStep(world_, dt);
    dJointGroupEmpty(joints_);
  }

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
    if (dGeomIsSpace(first) || dGeomIsSpace(second))
      dSpaceCollide2(first, second, data, near);
    else
      static_cast<Stepper*>(data)->collide(first, second);
  }

  void collide(dGeomID first, dGeomID second) {
    const dBodyID a = dGeomGetBody(first), b = dGeomGetBody(second);
    if (!a && !b) return;
    if (a && b && dAreConnectedExcluding(a, b, dJointTypeContact)) return;
    dContactGeom found[most_found];
    int count =
        dCollide(first, second, settings_.reducer == "first" ? settings_.contacts : most_found,
                 found, sizeof(dContactGeom));
    // What goes through the other as it should takes no other contact's place.
    const auto unwanted = [this](const dContactGeom& geom) { return !wanted(geom); };
    count = static_cast<int>(std::remove_if(found, found + count, unwanted) - found);
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
};

}  // namespace tradeoff

#endif
