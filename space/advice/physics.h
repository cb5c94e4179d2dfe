// Regimes in which ODE's solver is known to fail, and the rescue that tests/physics found.
#pragma once

#include <ode/ode.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace ode_parallel_sap {

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

  // What a look goes by. `swept`: the space's step for swept bounds, or 0.
  struct View {
    const dGeomID* geoms;
    std::size_t count;
    dReal swept;
    decltype(&dCollide) collide;  // the program's
  };

  // A collide of a look begins.
  void begin() {
    overlaps_.clear();
    places_.clear();
  }
  // One of its pairs that has a body awake.
  void see(dGeomID a, dGeomID b);
  // The first collide of a look has ended.
  void lookFirst(const View& view);
  // Likewise the second.
  void lookAgain(const View& view);

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
    dBodyID id;
    dVector3 position;
    dQuaternion turn;
  };
  struct Overlap {
    dGeomID a, b;
    double share;  // of the smaller one's size, by the AABBs
  };
  struct Worst {
    double excess = 0;  // in thresholds
    double number = 0;  // for the text
  };

  bool gather(const View& view);
  void mergeBodies();
  Body* find(dBodyID id);
  bool isBuilt(const Body& body) const;
  void measureStep();
  void noteDepths(decltype(&dCollide) collide);
  void noteFast();
  void noteContacts();
  void noteCarried(const Body& body, double heaviest);
  void noteJoints();
  void noteTurning();
  void note(Regime regime, double measure, double threshold, double number);

  std::vector<Body> bodies_;  // of the geoms that are looked at, by address
  std::vector<Place> places_;
  std::vector<Place> first_places_;  // of the bodies of the first look that found any, by address
  std::vector<Overlap> overlaps_;
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

}  // namespace ode_parallel_sap
