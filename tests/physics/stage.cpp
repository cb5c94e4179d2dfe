#include "stage.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "../support/bounds.h"
#include "../support/recorder.h"

namespace sap_test::physics {

namespace {

constexpr int kMostContacts = 8;

dSpaceID makeSpace(Pairing pairing) {
  switch (pairing) {
    case Pairing::simple_in_our_order:
      return dSimpleSpaceCreate(nullptr);
    case Pairing::hash:
      return dHashSpaceCreate(nullptr);
    default:
      return dParallelSAPSpaceCreate(nullptr);
  }
}

}  // namespace

Stage::Stage(Pairing pairing, const Setting& setting, double step)
    : pairing_(pairing),
      setting_(setting),
      step_(step),
      world_(dWorldCreate()),
      space_(makeSpace(pairing)),
      contact_joints_(dJointGroupCreate(0)) {
  dWorldSetGravity(world_, 0, 0, real(-9.81));
  dWorldSetERP(world_, real(setting.erp));
  dWorldSetCFM(world_, real(setting.cfm));
  dWorldSetQuickStepNumIterations(world_, setting.iterations);
  if (setting.correction > 0) {
    dWorldSetContactMaxCorrectingVel(world_, real(setting.correction));
  }
  if (setting.swept && pairing == Pairing::ours) {
    dParallelSAPSpaceSetSweptBounds(space_, real(step / setting.divide));
  }
}

Stage::~Stage() {
  dJointGroupDestroy(contact_joints_);
  dSpaceDestroy(space_);
  for (const Mesh& mesh : meshes_) dGeomTriMeshDataDestroy(mesh.data);
  dWorldDestroy(world_);
}

dGeomID Stage::take(dGeomID geom) {
  setNumber(geom, geoms_.size());
  geoms_.push_back(geom);
  return geom;
}

dGeomID Stage::plane() {
  return take(dCreatePlane(space_, 0, 0, 1, 0));
}

dGeomID Stage::block(const Vec& centre, const Vec& sides) {
  const dGeomID geom = take(dCreateBox(space_, real(sides[0]), real(sides[1]), real(sides[2])));
  dGeomSetPosition(geom, real(centre[0]), real(centre[1]), real(centre[2]));
  return geom;
}

dGeomID Stage::mesh(const std::vector<dReal>& vertices, const std::vector<dTriIndex>& triangles) {
  meshes_.push_back({{}, triangles, dGeomTriMeshDataCreate()});
  Mesh& mesh = meshes_.back();
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    mesh.vertices.push_back(vertices[i]);
    if (i % 3 == 2) mesh.vertices.push_back(0);  // a dVector3 has four numbers
  }
  dGeomTriMeshDataBuildSimple(mesh.data, mesh.vertices.data(),
                              static_cast<int>(mesh.vertices.size() / 4), mesh.triangles.data(),
                              static_cast<int>(mesh.triangles.size()));
  return take(dCreateTriMesh(space_, mesh.data, nullptr, nullptr, nullptr));
}

dBodyID Stage::wedge(const std::vector<Vec>& corners, const Vec& centre, double density) {
  // Faces by their corners, against the clock from outside; of a corner bit 2 is z, bit 1 x, bit 0
  // y.
  static unsigned faces[] = {4, 0, 1, 3, 2, 4, 4, 6, 7, 5, 4, 0, 4, 5, 1,
                             4, 2, 3, 7, 6, 4, 0, 2, 6, 4, 4, 1, 5, 7, 3};
  Vec middle = {};
  for (const Vec& corner : corners) middle = middle + 0.125 * corner;
  convexes_.emplace_back();
  std::vector<dReal>& points = convexes_.back();
  for (const Vec& corner : corners)
    for (const double x : minus(corner, middle)) points.push_back(real(x));
  convexes_.emplace_back();
  std::vector<dReal>& planes = convexes_.back();
  for (const unsigned* face = faces; face != std::end(faces); face += 5) {
    const auto at = [&](int i) { return minus(corners[face[i]], middle); };
    Vec normal = cross(minus(at(2), at(1)), minus(at(3), at(1)));
    normal = 1 / length(normal) * normal;
    for (const double x : normal) planes.push_back(real(x));
    planes.push_back(real(dot(normal, at(1))));
  }
  const Vec size = minus(corners[7], corners[0]);
  dMass mass;
  dMassSetBox(&mass, real(density), real(std::fabs(2 * corners[6][0])), real(size[1]),
              real(size[2]));
  return body(take(dCreateConvex(space_, planes.data(), 6, points.data(), 8, faces)), mass,
              centre + middle);
}

dBodyID Stage::body(dGeomID geom, const dMass& mass, const Vec& centre) {
  const dBodyID body = dBodyCreate(world_);
  dBodySetMass(body, &mass);
  if (geom) dGeomSetBody(geom, body);
  dBodySetPosition(body, real(centre[0]), real(centre[1]), real(centre[2]));
  bodies_.push_back(body);
  return body;
}

dBodyID Stage::box(const Vec& centre, const Vec& sides, double density) {
  dMass mass;
  dMassSetBox(&mass, real(density), real(sides[0]), real(sides[1]), real(sides[2]));
  return body(block(centre, sides), mass, centre);
}

dBodyID Stage::ball(const Vec& centre, double radius, double density) {
  dMass mass;
  dMassSetSphere(&mass, real(density), real(radius));
  return body(take(dCreateSphere(space_, real(radius))), mass, centre);
}

dBodyID Stage::rod(const Vec& centre, double radius, double length, double density) {
  dMass mass;
  dMassSetCapsule(&mass, real(density), 3, real(radius), real(length));
  return body(take(dCreateCapsule(space_, real(radius), real(length))), mass, centre);
}

void Stage::turn(std::size_t body, const Vec& axis, double angle) {
  dMatrix3 rotation;
  dRFromAxisAndAngle(rotation, real(axis[0]), real(axis[1]), real(axis[2]), real(angle));
  dBodySetRotation(bodies_[body], rotation);
}

void Stage::push(std::size_t body, const Vec& speed) {
  dBodySetLinearVel(bodies_[body], real(speed[0]), real(speed[1]), real(speed[2]));
}

void Stage::spin(std::size_t body, const Vec& speed) {
  dBodySetAngularVel(bodies_[body], real(speed[0]), real(speed[1]), real(speed[2]));
}

dJointID Stage::keep(dJointID joint) {
  joints_.push_back(joint);
  return joint;
}

dJointID Stage::ballJoint(dBodyID a, dBodyID b, const Vec& anchor) {
  const dJointID joint = keep(dJointCreateBall(world_, nullptr));
  dJointAttach(joint, a, b);
  dJointSetBallAnchor(joint, real(anchor[0]), real(anchor[1]), real(anchor[2]));
  return joint;
}

dJointID Stage::hinge(dBodyID a, dBodyID b, const Vec& anchor, const Vec& axis) {
  const dJointID joint = keep(dJointCreateHinge(world_, nullptr));
  dJointAttach(joint, a, b);
  dJointSetHingeAnchor(joint, real(anchor[0]), real(anchor[1]), real(anchor[2]));
  dJointSetHingeAxis(joint, real(axis[0]), real(axis[1]), real(axis[2]));
  return joint;
}

void Stage::move(const Vec& by) {
  origin_ = origin_ + by;
  for (const dGeomID geom : geoms_) {
    const dBodyID body = dGeomGetBody(geom);
    const dReal* const at = body ? dBodyGetPosition(body) : dGeomGetPosition(geom);
    const dReal x = at[0] + real(by[0]), y = at[1] + real(by[1]), z = at[2] + real(by[2]);
    if (body) {
      dBodySetPosition(body, x, y, z);
    } else {
      dGeomSetPosition(geom, x, y, z);
    }
  }
}

Vec Stage::place(std::size_t body) const {
  const dReal* const at = dBodyGetPosition(bodies_[body]);
  return {at[0] - origin_[0], at[1] - origin_[1], at[2] - origin_[2]};
}

void Stage::touch(dGeomID a, dGeomID b) {
  const dBodyID first = dGeomGetBody(a), second = dGeomGetBody(b);
  if (!first && !second) return;
  if (first && second && dAreConnectedExcluding(first, second, dJointTypeContact)) return;
  dContact found[kMostContacts] = {};
  const dReal step = setting_.swept ? real(step_ / setting_.divide) : 0;
  const int n =
      dParallelSAPCollideSwept(a, b, step, setting_.contacts, &found[0].geom, sizeof(dContact));
  for (int i = 0; i < n; ++i) {
    found[i].surface.mode = dContactApprox1;
    found[i].surface.mu = real(friction);
    if (surface) surface(found[i], first, second);
    if (found[i].geom.depth < 0 && !(found[i].surface.mode & dContactBounce)) {  // still to come
      found[i].surface.mode |= dContactMotionN;
      found[i].surface.motionN = found[i].geom.depth / step;
    }
    depth = std::fmax(depth, static_cast<double>(found[i].geom.depth));
    const dJointID joint = dJointCreateContact(world_, contact_joints_, &found[i]);
    dJointAttach(joint, first, second);
    if (joined) joined(joint);
  }
  contacts += static_cast<std::size_t>(n);
}

void Stage::findContacts() {
  if (pairing_ == Pairing::simple_in_our_order) {
    for (const Pair& pair : asSet(collide(space_))) touch(geoms_[pair.first], geoms_[pair.second]);
    return;
  }
  dSpaceCollide(space_, this,
                [](void* stage, dGeomID a, dGeomID b) { static_cast<Stage*>(stage)->touch(a, b); });
}

void Stage::stir(double distance) {
  if (setting_.start == 0 || setting_.aligned) return;
  dRandSetSeed(setting_.start);
  const auto off = [distance] { return real(distance * (2 * double(dRandReal()) - 1)); };
  for (const dBodyID body : bodies_) {
    const dReal* const at = dBodyGetPosition(body);
    dBodySetPosition(body, at[0] + off(), at[1] + off(), at[2] + off());
  }
}

void Stage::step() {
  for (int i = 0; i < setting_.divide; ++i) {
    // QuickStep draws from ODE's one random sequence.
    if (seeds_ && !setting_.exact) dRandSetSeed(++steps_ + 1000003ul * setting_.start);
    findContacts();
    const dReal length = real(step_ / setting_.divide);
    if (setting_.exact) {
      dWorldStep(world_, length);
    } else {
      dWorldQuickStep(world_, length);
    }
    dJointGroupEmpty(contact_joints_);
  }
}

double Stage::energy() const {
  const Vec gravity = tradeoff::gravityOf(world_);
  double sum = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Vec v = vec(dBodyGetLinearVel(bodies_[i]));
    sum += tradeoff::massOf(bodies_[i]) * (dot(v, v) / 2 - dot(gravity, place(i))) +
           tradeoff::spinEnergyOf(bodies_[i]);
  }
  return sum;
}

bool Stage::isFinite() const {
  const auto finite = [](const dReal* numbers, int count) {
    return std::all_of(numbers, numbers + count,
                       [](dReal number) { return std::isfinite(number); });
  };
  return std::all_of(bodies_.begin(), bodies_.end(), [&finite](dBodyID body) {
    return finite(dBodyGetPosition(body), 3) && finite(dBodyGetQuaternion(body), 4) &&
           finite(dBodyGetLinearVel(body), 3) && finite(dBodyGetAngularVel(body), 3);
  });
}

double gapOf(dJointID joint) {
  dVector3 a = {}, b = {};
  if (dJointGetType(joint) == dJointTypeBall) {
    dJointGetBallAnchor(joint, a);
    dJointGetBallAnchor2(joint, b);
  } else if (dJointGetType(joint) == dJointTypeHinge) {
    dJointGetHingeAnchor(joint, a);
    dJointGetHingeAnchor2(joint, b);
  }
  return length(minus(vec(a), vec(b)));
}

}  // namespace sap_test::physics
