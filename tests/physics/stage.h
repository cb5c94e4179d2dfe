// A simulated scene, for any solver's settings and any of three ways to find its pairs.
#pragma once

#include <ode/ode.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "../../examples/tradeoff/harness/vectors.h"

namespace sap_test::physics {

using Vec = tradeoff::Vector;
using tradeoff::cross;
using tradeoff::dot;
using tradeoff::length;
using tradeoff::minus;

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

// Who finds the pairs, and in which order contacts are made of them.
enum class Pairing {
  simple_in_our_order,  // dSimpleSpace, pairs sorted as dParallelSAPSpace promises them
  hash,                 // dHashSpace, as they come
  ours                  // dParallelSAPSpace, as they come
};

constexpr double kOdesCfm = sizeof(dReal) == 8 ? 1e-10 : 1e-5;

// How a scene is solved; as it is, the way ODE comes.
struct Setting {
  bool exact = false;   // dWorldStep instead of dWorldQuickStep
  int iterations = 20;  // of dWorldQuickStep
  int divide = 1;       // so many steps in the place of one
  int contacts = 4;     // of a pair at most: enough for two boxes face to face
  double erp = 0.2;
  double cfm = kOdesCfm;
  double correction = 0;  // m/s, dWorldSetContactMaxCorrectingVel; 0: as ODE comes, any
  unsigned start = 0;     // each but 0 has its own chance, and bodies a little elsewhere
  bool aligned = false;   // a start keeps the bodies exactly where they are built
  bool swept = false;     // swept contacts, with ours between swept bounds
};

class Stage {
 public:
  Stage(Pairing pairing, const Setting& setting, double step);
  ~Stage();
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  // What stays where it is.
  dGeomID plane();  // z = 0
  dGeomID block(const Vec& centre, const Vec& sides);
  // Triangles, three numbers a vertex and three vertices a triangle.
  dGeomID mesh(const std::vector<dReal>& vertices, const std::vector<dTriIndex>& triangles);
  dGeomID take(dGeomID geom);

  void noGravity() { dWorldSetGravity(world_, 0, 0, 0); }

  // Bodies; kilograms a cubic metre.
  dBodyID box(const Vec& centre, const Vec& sides, double density = 1000);
  dBodyID ball(const Vec& centre, double radius, double density = 1000);
  dBodyID rod(const Vec& centre, double radius, double length, double density = 1000);  // along z
  // A convex body of eight corners: by z, then x, then y of a box that is bent; about its middle.
  dBodyID wedge(const std::vector<Vec>& corners, const Vec& centre, double density);
  dBodyID body(dGeomID geom, const dMass& mass, const Vec& centre);  // no geom: touches nothing
  void turn(std::size_t body, const Vec& axis, double angle);
  void push(std::size_t body, const Vec& speed);
  void spin(std::size_t body, const Vec& speed);

  // Joints; no second body is the world. Anchors are given in the world.
  dJointID ballJoint(dBodyID a, dBodyID b, const Vec& anchor);
  dJointID hinge(dBodyID a, dBodyID b, const Vec& anchor, const Vec& axis);
  dJointID keep(dJointID joint);

  // Keeps what geoms read for as long as they last.
  void own(std::shared_ptr<void> data) { owned_.push_back(std::move(data)); }

  // Each body elsewhere by up to this, where there is a start that is not 0.
  void stir(double distance);

  // All of it elsewhere, as it stands.
  void move(const Vec& by);

  // One collide and one step, `divide` times.
  void step();
  // The random sequence goes on from step to step.
  void seedOnce() { seeds_ = false; }

  dWorldID world() const { return world_; }
  dSpaceID space() const { return space_; }
  const std::vector<dBodyID>& bodies() const { return bodies_; }
  const std::vector<dJointID>& joints() const { return joints_; }
  dBodyID operator[](std::size_t body) const { return bodies_[body]; }
  // Where the body is, seen from what moved with all of it.
  Vec place(std::size_t body) const;
  // Of motion and height.
  double energy() const;
  bool isFinite() const;  // every number of every body's state

  double friction = 0.8;
  // Changes a contact's surface, if there is any.
  std::function<void(dContact&, dBodyID, dBodyID)> surface;
  // Sees each contact joint.
  std::function<void(dJointID)> joined;
  // The deepest contact and the number of contacts since somebody set them to 0.
  double depth = 0;
  std::size_t contacts = 0;

 private:
  struct Mesh {
    std::vector<dReal> vertices;
    std::vector<dTriIndex> triangles;
    dTriMeshDataID data;
  };

  void findContacts();
  void touch(dGeomID a, dGeomID b);

  const Pairing pairing_;
  const Setting setting_;
  const double step_;
  const dWorldID world_;
  const dSpaceID space_;
  const dJointGroupID contact_joints_;
  std::vector<dGeomID> geoms_;
  std::vector<dBodyID> bodies_;
  std::vector<dJointID> joints_;
  std::deque<Mesh> meshes_;
  std::deque<std::vector<dReal>> convexes_;
  std::vector<std::shared_ptr<void>> owned_;
  Vec origin_ = {0, 0, 0};
  unsigned long steps_ = 0;
  bool seeds_ = true;
};

// How far a joint's two anchors are apart.
double gapOf(dJointID joint);

}  // namespace sap_test::physics
