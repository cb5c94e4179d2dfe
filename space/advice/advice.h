// What options would leave out of a program's pairs, and where physics breaks: the lines that
// ODE_PARALLEL_SAP_STATS=1 prints.
#pragma once

#include <ode/ode.h>

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "space/ode/space_observer.h"

namespace ode_parallel_sap {

// Regimes in which ODE's solver is known to fail, and the rescue that tests/physics found.
//
// Looks at geoms, bodies and joints when all callbacks of a collide are done: two bodies touch if
// the program has made a contact joint of them. Two collides make a look, since the length of a
// step is measured between them.
class Physics {
 public:
  enum Regime {
    mass_ratio,
    load,
    small_body,
    fast,
    deep,
    soft,
    hanging,
    turning,
    far_away,
    restless,
    many_contacts,
    regimes
  };

  // A collide of a look begins.
  void begin() {
    overlaps_.clear();
    places_.clear();
  }
  // One of its pairs that has a body awake.
  void see(dGeomID a, dGeomID b);
  // A geom leaves the space, or with null any one a sub-space.
  void forget(const dxGeom* geom);
  // The first collide of a look has ended, and the second. `swept`: the space's step for swept
  // bounds, or 0. The first returns whether a body is awake.
  bool lookFirst(const dGeomID* geoms, std::size_t count, dReal swept);
  void lookAgain(const dGeomID* geoms, std::size_t count, dReal swept);

  // Adds what another space's has found.
  void add(const Physics& other);
  // A line for each regime: its name, what was seen, and what helps.
  std::vector<std::string> lines() const;

 private:
  struct Body {
    dBodyID id = nullptr;
    double size = 0;   // the largest of its geoms' middle sides
    double thin = 0;   // likewise of the smallest sides
    double reach = 0;  // from its position to the farthest corner of an AABB
    double mass = 0, height = 0;
    double carried = 0;  // mass, by contacts or joints
    int level = -1;      // joints from there to the world
    bool touches = false, jointed = false;
  };
  struct Place {
    dVector3 position;
    dQuaternion turn;
  };
  struct Worst {
    double excess = 0;  // in thresholds
    double number = 0;  // for the text
  };

  bool gather(const dGeomID* geoms, std::size_t count, dReal swept);
  Body* find(dBodyID id);
  bool isBuilt(const Body& body) const;
  void measureStep();
  void noteDepths();
  void noteFast();
  void noteContacts();
  void noteCarried(const Body& body, double heaviest);
  void noteJoints();
  void noteTurning();
  void note(Regime regime, double measure, double number);

  std::map<dBodyID, Body> bodies_;  // of the geoms that are looked at
  std::map<dBodyID, Place> places_;
  std::map<dBodyID, Place> first_places_;  // of the bodies of the first look that found any
  struct Overlap {
    dGeomID a, b;
    double share;  // of the smaller one's size
  };
  std::vector<Overlap> overlaps_;  // the deepest pairs by their boxes
  double thinnest_fixed_ = 0;      // of the geoms without a body
  bool any_sheet_ = false;         // a mesh is among them
  double step_ = 0;                // seconds; 0: unknown
  double gravity_ = 0, fall_ = 0;  // m/s^2; metres a step
  dVector3 down_ = {0, 0, 0, 0};
  dWorldID world_ = nullptr;
  std::size_t from_ = 0;  // the first geom of the next look
  bool swept_ = false;
  std::array<Worst, regimes> worst_;
};

// Counts all pairs of one frame in `interval`, or fewer while all bodies are asleep, and looks at
// bodies after it and the next one.
// Nothing but the lines depends on it.
class Advice final : public SpaceObserver {
 public:
  // Of a space, for which it prints the lines in the end; or for an account of several.
  explicit Advice(const void* space = nullptr) : space_(space) {}
  ~Advice() override;

  bool isDue() override;
  void see(dGeomID a, dGeomID b, int contacts) override;
  void endFrame(dxGeom* const* geoms, std::size_t slots, dReal swept) override;
  void forget(const dxGeom* geom) override { physics_.forget(geom); }
  const Physics& physics() const { return physics_; }

  // Adds what another space's has seen.
  void add(const Advice& other);
  // A line that names the options that would have left out a part of the pairs worth mentioning, if
  // there are any, and those of Physics.
  std::vector<std::string> lines() const;

 private:
  static constexpr unsigned interval = 64;  // fixed: a pass over the pairs then costs 1 % at most
  static constexpr unsigned resting_interval = 16 * interval;  // fixed: likewise, of shorter frames

  using Categories =
      std::pair<unsigned long, unsigned long>;  // of two geoms, the smaller one first
  struct Contacts {
    unsigned long long pairs = 0, touching = 0;
  };

  void count(const Categories& categories, const Contacts& more);
  double shareOf(unsigned long long pairs) const {
    return all_ ? static_cast<double>(pairs) / static_cast<double>(all_) : 0;
  }

  const void* const space_;
  unsigned frames_ = 0;
  bool awake_ = false;                 // of a pair of the last look
  bool resting_ = false;               // no body was awake then
  unsigned place_ = resting_interval;  // of the frame that runs among so many
  Physics physics_;
  unsigned long long all_ = 0, static_ = 0, asleep_ = 0, clear_ = 0;  // clear of a plane
  std::map<Categories, Contacts> layers_;  // of pairs of which it is known whether they touch
};

}  // namespace ode_parallel_sap
