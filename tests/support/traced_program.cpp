#include "traced_program.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "scenes.h"
#include "user_box.h"

namespace sap_test {

TracedProgram::TracedProgram(std::uint64_t seed, int geoms)
    : random_(seed),
      world_(dWorldCreate()),
      space_(dParallelSAPSpaceCreate(nullptr)),
      side_(1.8 * std::cbrt(geoms)) {
  for (int i = 0; i < 1 + geoms / 4; ++i) bodies_.push_back(dBodyCreate(world_));
  for (int i = 0; i < 1 + geoms / 30; ++i) addSpace();
  for (int i = 0; i < geoms; ++i) add(anySpace());
}

TracedProgram::~TracedProgram() {
  dSpaceDestroy(space_);
  dWorldDestroy(world_);
}

dReal TracedProgram::coordinate() {
  return static_cast<dReal>(random_.between(0, side_));
}

// Boxes of all sizes, some of size 0, and one of each class. A user's AABBTest is in no trace.
dGeomID TracedProgram::makeGeom() {
  const auto size = [this] { return static_cast<dReal>(random_.between(0.2, 2)); };
  if (random_.chance(0.5)) return dCreateBox(nullptr, random_.chance(0.1) ? 0 : size(), size(), 1);
  const Shape& shape = shapes()[random_.below(shapes().size())];
  if (shape.name == std::string("user class with AABBTest") ||
      (!shape.placeable && random_.chance(0.8)))
    return dCreateSphere(nullptr, size());
  return shape.create(nullptr);
}

dSpaceID TracedProgram::anySpace() {
  return random_.chance(0.75) ? space_ : inner_[random_.below(inner_.size())];
}

// Of any kind, within another one now and then.
void TracedProgram::addSpace() {
  const dSpaceID outer = inner_.empty() || random_.chance(0.6) ? space_ : inner_.back();
  switch (random_.below(3)) {
    case 0:
      inner_.push_back(dSimpleSpaceCreate(outer));
      break;
    case 1:
      inner_.push_back(dHashSpaceCreate(outer));
      break;
    default:
      inner_.push_back(dParallelSAPSpaceCreate(outer));
  }
}

void TracedProgram::add(dSpaceID space) {
  const dGeomID geom = makeGeom();
  dSpaceAdd(space, geom);
  members_.push_back({geom, space, dGeomGetClass(geom) != dPlaneClass});
  Member& member = members_.back();
  if (random_.chance(0.6)) changeBody(member);
  move(member);
}

void TracedProgram::move(Member& member) {
  if (!member.placeable) return;
  dMatrix3 rotation;
  dRFromEulerAngles(rotation, coordinate(), coordinate(), coordinate());
  dGeomSetPosition(member.geom, coordinate(), coordinate(), coordinate());
  if (random_.chance(0.5)) dGeomSetRotation(member.geom, rotation);
  if (isUserBox(member.geom) && random_.chance(0.3)) {
    Bounds bounds = userBoxData(member.geom).bounds;
    for (dReal& bound : bounds) bound += static_cast<dReal>(0.125);
    if (random_.chance(0.1)) bounds[1] = bounds[0] - 1;
    setUserBounds(member.geom, bounds);
  }
}

void TracedProgram::resize(dGeomID geom) {
  const dReal size = static_cast<dReal>(random_.between(0.3, 1.7));
  if (dGeomGetClass(geom) == dBoxClass) dGeomBoxSetLengths(geom, size, 1, size);
  if (dGeomGetClass(geom) == dSphereClass) dGeomSphereSetRadius(geom, size);
  if (dGeomGetClass(geom) == dRayClass) dGeomRaySetLength(geom, size);
  if (dGeomGetClass(geom) == dPlaneClass) dGeomPlaneSetParams(geom, 0, 0, 1, size);
}

// On a body, of which some have several geoms, or on none.
void TracedProgram::changeBody(Member& member) {
  if (!member.placeable) return;
  if (dGeomIsOffset(member.geom)) dGeomClearOffset(member.geom);  // or ODE asserts
  if (random_.chance(0.2)) return dGeomSetBody(member.geom, nullptr);
  dGeomSetBody(member.geom, bodies_[random_.below(bodies_.size())]);
  if (random_.chance(0.5)) dGeomSetOffsetPosition(member.geom, coordinate() / 4, 0, 1);
}

void TracedProgram::removeMember(std::size_t place) {
  const Member member = members_[place];
  dSpaceRemove(member.in, member.geom);
  if (random_.chance(0.5)) {
    dGeomDestroy(member.geom);
    members_.erase(members_.begin() + static_cast<std::ptrdiff_t>(place));
    return;
  }
  members_[place].in = anySpace();
  dSpaceAdd(members_[place].in, member.geom);
}

void TracedProgram::editMember(std::size_t place) {
  Member& member = members_[place];
  switch (random_.below(8)) {
    case 0:
      return dGeomDisable(member.geom);
    case 1:
      return dGeomEnable(member.geom);
    case 2:
      return dGeomSetCategoryBits(member.geom, 1ul << random_.below(3));
    case 3:
      return dGeomSetCollideBits(member.geom, random_.chance(0.3) ? ~0ul : random_.bits() & 7u);
    case 4:
      return resize(member.geom);
    case 5:
      return changeBody(member);
    case 6:
      return removeMember(place);
    default:
      return move(member);
  }
}

void TracedProgram::changeSettings() {
  dParallelSAPSpaceSetSkipStatic(space_, random_.chance(0.3));
  dParallelSAPSpaceSetSkipAsleep(space_, random_.chance(0.3));
  dParallelSAPSpaceSetCullPlanes(space_, random_.chance(0.3));
}

void TracedProgram::edit() {
  const std::size_t count = members_.size();
  for (std::size_t i = 0; i < count / 4; ++i) move(members_[random_.below(members_.size())]);
  for (std::size_t i = 0; i < 1 + count / 10 && members_.size() > 4; ++i)
    editMember(random_.below(members_.size()));
  for (const dBodyID body : bodies_) {
    if (random_.chance(0.1)) dBodyDisable(body);
    if (random_.chance(0.1)) dBodyEnable(body);
  }
  if (random_.chance(0.5)) add(anySpace());
  if (random_.chance(0.2)) changeSettings();
  // Many go at once now and then, so that slots are closed up.
  if (random_.chance(0.05))
    for (std::size_t i = 0; i < count / 3; ++i) removeMember(random_.below(members_.size()));
}

}  // namespace sap_test
