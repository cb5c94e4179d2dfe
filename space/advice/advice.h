// What options would leave out of a program's pairs, and where physics breaks: the lines that
// ODE_PARALLEL_SAP_STATS=1 prints.
#pragma once

#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "space/geoms/space_observer.h"

namespace ode_parallel_sap {

// Regimes in which ODE's solver is known to fail, and what helps there.
//
// Looks at geoms, bodies and joints when all callbacks of a collide are done: two bodies touch if
// the program has made a contact joint of them. Two collides make a look, since the length of a
// step is measured between them. Between looks, glances find what comes and goes.
class Physics {
 public:
  enum Regime {
    mass_ratio,
    load,
    aligned,
    small_body,
    fast,
    deep,
    soft,
    hanging,
    held,
    turning,
    far_away,
    forces,
    restless,
    many_contacts,
    regimes
  };

  // A collide of a look begins, the one of this number.
  void begin(unsigned long long frame) {
    frame_ = frame;
    ++looks_;
    seed_ = dRandGetSeed();
    overlaps_.clear();
    places_.clear();
    world_pairs_ = 0;
  }
  // One of its pairs that has a body awake.
  void see(dGeomID a, dGeomID b);
  // A geom leaves the space, or with null any one a sub-space.
  void forget(const dxGeom* geom);
  // The first collide of a look has ended, and the second. `swept`: the space's step for swept
  // bounds, or 0.
  void lookFirst(const dGeomID* geoms, std::size_t count, dReal swept);
  void lookAgain(const dGeomID* geoms, std::size_t count, dReal swept);
  // Another collide has ended. Whether the next one should begin a look: geoms came, or one of a
  // sixteenth of the geoms, in turn, is fast or pushed out of another one.
  bool glance(const dGeomID* geoms, std::size_t count);

  // Adds what another space's has found.
  void add(const Physics& other);
  // A line for each regime: its name, what was seen, what helps, when it was seen and where.
  std::vector<std::string> lines() const;
  // What the line of this number, from 0 on, is about; false if there is none.
  bool find(int line, dParallelSAPWarning* warning) const;

 private:
  struct Body {
    dBodyID id = nullptr;
    double size = 0;    // the largest of its geoms' middle sides
    double thin = 0;    // likewise of the smallest sides
    double reach = 0;   // from its position to the farthest corner of an AABB
    double along = 0;   // the largest of its geoms' sides along its speed
    double length = 0;  // likewise of the longest sides
    double turns = 0;   // radians a second that sweep something
    double mass = 0, height = 0;
    double carried = 0;             // mass, by contacts or joints
    double heaviest = 0;            // of those that lie on it
    int storeys = 1, straight = 1;  // bodies above each other, and exactly so
    int level = -1, links = 1;      // joints from there to the world; bodies from there on
    bool touches = false, jointed = false, is_held = false;
    dGeomID geom = nullptr;
  };
  struct Place {
    dVector3 position;
    dQuaternion turn;
    dVector3 speed;
  };
  struct Worst {
    double excess = 0;  // in thresholds
    double number = 0;  // for the text
    dGeomID geoms[2] = {nullptr, nullptr};
    bool have_left[2] = {false, false};
    char remedy[128] = "";
    unsigned looks = 0, last_look = 0;       // that saw it
    unsigned long long first = 0, last = 0;  // collides of these
  };

  bool isUrgent(dGeomID geom) const;
  bool gather(const dGeomID* geoms, std::size_t count, dReal swept);
  Body* find(dBodyID id);
  bool isBuilt(const Body& body) const;
  bool areAligned(const Body& a, const Body& b) const;
  void measureStep();
  void findDepths();
  void noteDepths();
  bool isNamed(std::size_t regime) const;
  void noteFast();
  void noteContacts();
  void noteCarried(const Body& body);
  void noteJoints();
  void noteTurning();
  bool note(Regime regime, double measure, double number, dGeomID a = nullptr, dGeomID b = nullptr);
  template <class... Numbers>
  void remedy(Regime regime, const char* text, Numbers... numbers);

  std::map<dBodyID, Body> bodies_;  // of the geoms that are looked at
  std::map<dBodyID, Place> places_;
  std::map<dBodyID, Place> first_places_;  // of the bodies of the first look that found any
  struct Overlap {
    dGeomID a, b;
    double share;  // of the smaller one's size
  };
  std::vector<Overlap> overlaps_;  // the deepest pairs by their boxes
  struct Depth {
    dGeomID a, b;
    double correction, depth, size, speed;  // m/s; metres; m/s
  };
  std::vector<Depth> depths_;      // of those of the first collide that touch
  double thinnest_fixed_ = 0;      // of the geoms without a body
  bool any_sheet_ = false;         // a mesh is among them
  double world_pairs_ = 0;         // of a body and one of them, in the first collide
  double step_ = 0;                // seconds; 0: unknown
  double gravity_ = 0, fall_ = 0;  // m/s^2; metres a step
  dVector3 down_ = {0, 0, 0, 0};
  dWorldID world_ = nullptr;
  double lightest_ = 0, sink_ = 0;  // of what touches; sizes, with a CFM of step/lightest_
  bool is_quick_ = true;            // random numbers were drawn: dWorldStep draws none
  unsigned long seed_ = 0;
  unsigned looks_ = 0;
  unsigned long long frame_ = 0;
  std::size_t from_ = 0;    // the first geom of the next look
  std::size_t glance_ = 0;  // and of the next glance
  std::size_t known_ = 0;   // geoms of the last collide
  bool swept_ = false;
  std::array<Worst, regimes> worst_;
};

// Counts all pairs of one frame in `interval`, and of those that follow an urgent glance, and looks
// at bodies after it and the next one.
// Nothing but the lines depends on it.
class Advice final : public SpaceObserver {
 public:
  // Of a space, for which it prints the lines in the end; or for an account of several.
  explicit Advice(const void* space = nullptr) : space_(space) {}
  bool isDue() override;
  void see(dGeomID a, dGeomID b) override;
  void endFrame(dxGeom* const* geoms, std::size_t slots, dReal swept) override;
  void end(double pairs_ms, double frame_ms) override;
  void forget(const dxGeom* geom) override { physics_.forget(geom); }
  const Physics& physics() const { return physics_; }

  // Adds what another space's has seen.
  void add(const Advice& other);
  // A line that names the options that would have left out a part of the pairs worth mentioning, if
  // there are any, with their share of the time by pair, which programs that ignore these pairs at
  // once do not save, and those of Physics.
  std::vector<std::string> lines(double pairs_ms, double frame_ms) const;

 private:
  static constexpr unsigned interval = 64;    // fixed: a pass over the pairs then costs 1 % at most
  static constexpr unsigned most_urgent = 3;  // fixed: of an interval; likewise

  double shareOf(unsigned long long pairs) const {
    return all_ ? static_cast<double>(pairs) / static_cast<double>(all_) : 0;
  }

  const void* const space_;
  unsigned frames_ = 0;
  unsigned since_ = 0;      // frames since the last look began
  unsigned urgent_ = 0;     // looks of this interval
  bool is_urgent_ = false;  // one should begin
  bool runs_ = false;       // a frame
  Physics physics_;
  unsigned long long all_ = 0, static_ = 0, asleep_ = 0, clear_ = 0;  // clear of a plane
};

}  // namespace ode_parallel_sap
