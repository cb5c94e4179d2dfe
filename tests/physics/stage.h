// A simulated scene, for any solver's settings and any of three ways to find its pairs.
#pragma once

#include <ode/ode.h>

#include <cstdint>
#include <cstdio>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "../../examples/tradeoff/harness/vectors.h"
#include "../support/bounds.h"

namespace sap_test::physics {

using Vec = tradeoff::Vector;
using tradeoff::cross;
using tradeoff::dot;
using tradeoff::length;
using tradeoff::minus;

constexpr double kPi = 3.14159265358979323846, kGravity = 9.81;

inline Vec vec(const dReal* numbers) {
  return tradeoff::vectorOf(numbers);
}
inline Vec operator+(Vec a, const Vec& b) {
  tradeoff::addScaled(a, 1, b);
  return a;
}
inline Vec operator*(double factor, const Vec& v) {
  return {factor * v[0], factor * v[1], factor * v[2]};
}
// Calls a setter of three numbers.
template <class Set, class Object>
void set(Set setter, Object object, const Vec& v) {
  setter(object, real(v[0]), real(v[1]), real(v[2]));
}

// For names: 0.001 and 1e+06.
inline std::string text(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", number);
  return text;
}

// Bodies or fixed geoms in a row.
struct Thing {
  enum Kind { plane, fixed, box, ball } kind;  // plane: z = 0
  Vec at = {};
  Vec sides = {1, 1, 1};  // of a ball: its radius first
  double density = 1000;  // kilograms a cubic metre
  Vec speed = {}, spin = {};
  int count = 1;
  Vec next = {};  // from one to the next; the first is half of that from `at`
};
using Things = std::vector<Thing>;

// Who finds the pairs, and in which order contacts are made of them.
enum class Pairing {
  simple_in_our_order,  // dSimpleSpace, pairs sorted as dParallelSAPSpace promises them
  hash,                 // dHashSpace, as they come
  ours                  // dParallelSAPSpace, as they come
};

// How a scene is solved; as it is, the way ODE comes.
struct Setting {
  const char* name = "as ODE comes";
  bool exact = false;   // dWorldStep instead of dWorldQuickStep
  int iterations = 20;  // of dWorldQuickStep
  int divide = 1;       // so many steps in the place of one
  double erp = 0.2;
  double cfm = sizeof(dReal) == 8 ? 1e-10 : 1e-5;
  bool soft = false;   // CFM is step / mass of the lightest body
  bool swept = false;  // swept contacts, with ours between swept bounds
  unsigned start = 0;  // each but 0 has its own chance, and bodies a little elsewhere
};

class Stage {
 public:
  Stage(Pairing pairing, const Setting& setting, double step,
        const Vec& gravity = {0, 0, -kGravity});
  ~Stage();
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  void add(const Things& things);
  dBodyID add(const Thing& thing);  // the last body; null if the things have none
  // Triangles, three numbers a vertex and three vertices a triangle.
  void mesh(const std::vector<Vec>& vertices, const std::vector<dTriIndex>& triangles);
  // A convex body of eight corners: by z, then x, then y of a box that is bent; about its middle.
  void wedge(const std::vector<Vec>& corners, const Vec& centre, double density);
  dBodyID body(dGeomID geom, const dMass& mass, const Vec& centre);  // no geom: touches nothing
  dGeomID take(dGeomID geom);
  void turn(std::size_t body, const Vec& axis, double angle);
  void push(std::size_t body, const Vec& speed) { set(dBodySetLinearVel, bodies_[body], speed); }
  void spin(std::size_t body, const Vec& speed) { set(dBodySetAngularVel, bodies_[body], speed); }

  // Joints; no second body is the world. Anchors are given in the world.
  dJointID ballJoint(dBodyID a, dBodyID b, const Vec& anchor);
  dJointID hinge(dBodyID a, dBodyID b, const Vec& anchor, const Vec& axis);
  dJointID keep(dJointID joint, dBodyID a, dBodyID b);

  // Each body elsewhere by up to this, where there is a start that is not 0.
  void stir(double distance);
  // One collide and one step, `divide` times.
  void step();
  // The random sequence goes on from step to step.
  void seedOnce() { seeds_ = false; }

  dWorldID world() const { return world_; }
  dSpaceID space() const { return space_; }
  const std::vector<dBodyID>& bodies() const { return bodies_; }
  const std::vector<dJointID>& joints() const { return joints_; }
  dBodyID operator[](std::size_t body) const { return bodies_[body]; }
  Vec place(std::size_t body) const { return vec(dBodyGetPosition(bodies_[body])); }
  Vec speed(std::size_t body) const { return vec(dBodyGetLinearVel(bodies_[body])); }
  Vec rate(std::size_t body) const { return vec(dBodyGetAngularVel(bodies_[body])); }
  // Of motion and height.
  double energy() const;
  bool isFinite() const;  // every number of every body's state

  double friction = 0.8, bounce = 0;
  // Changes a contact's surface, if there is any.
  std::function<void(dContact&)> surface;
  // Sees each contact joint.
  std::function<void(dJointID)> joined;
  // The deepest contact since somebody set it to 0; seconds.
  double depth = 0, time = 0;
  static inline long steps_of_all = 0;  // of the solver

 private:
  void touch(dGeomID a, dGeomID b);

  const Pairing pairing_;
  const Setting setting_;
  const double step_;  // of the solver
  const dWorldID world_;
  const dSpaceID space_;
  const dJointGroupID contact_joints_;
  std::vector<dGeomID> geoms_;
  std::vector<dBodyID> bodies_;
  std::vector<dJointID> joints_;
  std::deque<std::vector<dReal>> numbers_;  // that geoms read
  std::deque<std::vector<dTriIndex>> triangles_;
  std::vector<dTriMeshDataID> meshes_;
  unsigned long steps_ = 0;
  bool seeds_ = true;
};

}  // namespace sap_test::physics
