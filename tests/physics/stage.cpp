#include "stage.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>

#include "../support/recorder.h"

namespace sap_test::physics {

namespace {

constexpr int kMostContacts = 4;  // of a pair: enough for two boxes face to face

dMass massOf(const Thing& thing) {
  dMass mass;
  const Vec& s = thing.sides;
  if (thing.kind == Thing::ball)
    dMassSetSphere(&mass, real(thing.density), real(s[0]));
  else
    dMassSetBox(&mass, real(thing.density), real(s[0]), real(s[1]), real(s[2]));
  return mass;
}

}  // namespace

Stage::Stage(Pairing pairing, const Setting& setting, double step, const Vec& gravity)
    : pairing_(pairing),
      setting_(setting),
      step_(step / setting.divide),
      world_(dWorldCreate()),
      space_(pairing == Pairing::simple_in_our_order ? dSimpleSpaceCreate(nullptr)
             : pairing == Pairing::hash              ? dHashSpaceCreate(nullptr)
                                                     : dParallelSAPSpaceCreate(nullptr)),
      contact_joints_(dJointGroupCreate(0)) {
  set(dWorldSetGravity, world_, gravity);
  dWorldSetERP(world_, real(setting.erp));
  dWorldSetCFM(world_, real(setting.cfm));
  dWorldSetQuickStepNumIterations(world_, setting.iterations);
  if (setting.swept && pairing == Pairing::ours)
    dParallelSAPSpaceSetSweptBounds(space_, real(step_));
}

Stage::~Stage() {
  dJointGroupDestroy(contact_joints_);
  dSpaceDestroy(space_);
  for (const dTriMeshDataID mesh : meshes_) dGeomTriMeshDataDestroy(mesh);
  dWorldDestroy(world_);
}

dGeomID Stage::take(dGeomID geom) {
  setNumber(geom, geoms_.size());
  geoms_.push_back(geom);
  return geom;
}

void Stage::add(const Things& things) {
  for (const Thing& thing : things) add(thing);
}

dBodyID Stage::add(const Thing& thing) {
  if (thing.kind == Thing::plane) take(dCreatePlane(space_, 0, 0, 1, 0));
  const Vec& s = thing.sides;
  for (int i = 0; i < thing.count && thing.kind != Thing::plane; ++i) {
    const Vec at = thing.at + (i + 0.5) * thing.next;
    const dGeomID geom =
        take(thing.kind == Thing::ball ? dCreateSphere(space_, real(s[0]))
                                       : dCreateBox(space_, real(s[0]), real(s[1]), real(s[2])));
    set(dGeomSetPosition, geom, at);
    if (thing.kind == Thing::fixed) continue;
    body(geom, massOf(thing), at);
    push(bodies_.size() - 1, thing.speed);
    spin(bodies_.size() - 1, thing.spin);
  }
  return bodies_.empty() ? nullptr : bodies_.back();
}

void Stage::mesh(const std::vector<Vec>& vertices, const std::vector<dTriIndex>& triangles) {
  std::vector<dReal>& numbers = numbers_.emplace_back();
  for (const Vec& v : vertices)  // a dVector3 has four numbers
    numbers.insert(numbers.end(), {real(v[0]), real(v[1]), real(v[2]), 0});
  triangles_.push_back(triangles);
  meshes_.push_back(dGeomTriMeshDataCreate());
  dGeomTriMeshDataBuildSimple(meshes_.back(), numbers.data(), static_cast<int>(vertices.size()),
                              triangles_.back().data(), static_cast<int>(triangles.size()));
  take(dCreateTriMesh(space_, meshes_.back(), nullptr, nullptr, nullptr));
}

void Stage::wedge(const std::vector<Vec>& corners, const Vec& centre, double density) {
  // Faces by their corners, against the clock from outside; of a corner bit 2 is z, bit 1 x, bit 0
  // y.
  static unsigned faces[] = {4, 0, 1, 3, 2, 4, 4, 6, 7, 5, 4, 0, 4, 5, 1,
                             4, 2, 3, 7, 6, 4, 0, 2, 6, 4, 4, 1, 5, 7, 3};
  Vec middle = {};
  for (const Vec& corner : corners) middle = middle + 0.125 * corner;
  std::vector<dReal>&points = numbers_.emplace_back(), &planes = numbers_.emplace_back();
  for (const Vec& corner : corners)
    for (const double x : minus(corner, middle)) points.push_back(real(x));
  for (const unsigned* face = faces; face != std::end(faces); face += 5) {
    const auto at = [&](int i) { return minus(corners[face[i]], middle); };
    Vec normal = cross(minus(at(2), at(1)), minus(at(3), at(1)));
    normal = 1 / length(normal) * normal;
    for (const double x : normal) planes.push_back(real(x));
    planes.push_back(real(dot(normal, at(1))));
  }
  const Vec size = minus(corners[7], corners[0]);
  const Thing like = {Thing::box, {}, {std::fabs(2 * corners[6][0]), size[1], size[2]}, density};
  body(take(dCreateConvex(space_, planes.data(), 6, points.data(), 8, faces)), massOf(like),
       centre + middle);
}

dBodyID Stage::body(dGeomID geom, const dMass& mass, const Vec& centre) {
  const dBodyID body = dBodyCreate(world_);
  dBodySetMass(body, &mass);
  if (geom) dGeomSetBody(geom, body);
  set(dBodySetPosition, body, centre);
  bodies_.push_back(body);
  return body;
}

void Stage::turn(std::size_t body, const Vec& axis, double angle) {
  dMatrix3 rotation;
  dRFromAxisAndAngle(rotation, real(axis[0]), real(axis[1]), real(axis[2]), real(angle));
  dBodySetRotation(bodies_[body], rotation);
}

dJointID Stage::keep(dJointID joint, dBodyID a, dBodyID b) {
  dJointAttach(joint, a, b);
  return joints_.emplace_back(joint);
}

dJointID Stage::ballJoint(dBodyID a, dBodyID b, const Vec& anchor) {
  const dJointID joint = keep(dJointCreateBall(world_, nullptr), a, b);
  set(dJointSetBallAnchor, joint, anchor);
  return joint;
}

dJointID Stage::hinge(dBodyID a, dBodyID b, const Vec& anchor, const Vec& axis) {
  const dJointID joint = keep(dJointCreateHinge(world_, nullptr), a, b);
  set(dJointSetHingeAnchor, joint, anchor);
  set(dJointSetHingeAxis, joint, axis);
  return joint;
}

void Stage::touch(dGeomID a, dGeomID b) {
  const dBodyID first = dGeomGetBody(a), second = dGeomGetBody(b);
  if (!first && !second) return;
  if (first && second && dAreConnectedExcluding(first, second, dJointTypeContact)) return;
  dContact found[kMostContacts] = {};
  const dReal step = setting_.swept ? real(step_) : 0;
  const int n =
      dParallelSAPCollideSwept(a, b, step, kMostContacts, &found[0].geom, sizeof(dContact));
  for (int i = 0; i < n; ++i) {
    dContact& contact = found[i];
    contact.surface.mode = dContactApprox1;
    contact.surface.mu = real(friction);
    if (bounce > 0) {
      contact.surface.mode |= dContactBounce;
      contact.surface.bounce = real(bounce);
    }
    if (surface) surface(contact);
    if (contact.geom.depth < 0 && bounce == 0) {  // still to come
      contact.surface.mode |= dContactMotionN;
      contact.surface.motionN = contact.geom.depth / step;
    }
    depth = std::fmax(depth, static_cast<double>(contact.geom.depth));
    const dJointID joint = dJointCreateContact(world_, contact_joints_, &contact);
    dJointAttach(joint, first, second);
    if (joined) joined(joint);
  }
}

void Stage::stir(double distance) {
  if (setting_.start == 0) return;
  dRandSetSeed(setting_.start);
  const auto off = [distance] { return real(distance * (2 * double(dRandReal()) - 1)); };
  for (const dBodyID body : bodies_) {
    const dReal* const at = dBodyGetPosition(body);
    dBodySetPosition(body, at[0] + off(), at[1] + off(), at[2] + off());
  }
}

void Stage::step() {
  if (setting_.soft && time == 0) {
    double lightest = 1e300;
    for (const dBodyID b : bodies_) lightest = std::min(lightest, tradeoff::massOf(b));
    dWorldSetCFM(world_, real(step_ / lightest));
  }
  for (int i = 0; i < setting_.divide; ++i) {
    // QuickStep draws from ODE's one random sequence.
    if (seeds_ && !setting_.exact) dRandSetSeed(++steps_ + 1000003ul * setting_.start);
    if (pairing_ == Pairing::simple_in_our_order)
      for (const Pair& pair : asSet(collide(space_)))
        touch(geoms_[pair.first], geoms_[pair.second]);
    else
      dSpaceCollide(space_, this, [](void* stage, dGeomID a, dGeomID b) {
        static_cast<Stage*>(stage)->touch(a, b);
      });
    (setting_.exact ? dWorldStep : dWorldQuickStep)(world_, real(step_));
    dJointGroupEmpty(contact_joints_);
    time += step_;
    ++steps_of_all;
  }
}

double Stage::energy() const {
  const Vec gravity = tradeoff::gravityOf(world_);
  double sum = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    sum += tradeoff::massOf(bodies_[i]) * (dot(speed(i), speed(i)) / 2 - dot(gravity, place(i))) +
           tradeoff::spinEnergyOf(bodies_[i]);
  return sum;
}

bool Stage::isFinite() const {
  dReal zero = 0;  // a product with 0 is 0 or no number
  for (const dBodyID body : bodies_) {
    const dReal* const states[] = {dBodyGetPosition(body), dBodyGetLinearVel(body),
                                   dBodyGetAngularVel(body), dBodyGetQuaternion(body)};
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < (i == 3 ? 4 : 3); ++k) zero += 0 * states[i][k];
  }
  return zero == 0;
}

}  // namespace sap_test::physics
