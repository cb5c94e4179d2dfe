#include "ode_geoms.h"

#include "../program.h"

namespace bench {
namespace {

std::size_t numberOf(dGeomID geom) {
  return reinterpret_cast<std::size_t>(dGeomGetData(geom));
}

void tell(void* data, dGeomID first, dGeomID second) {
  (*static_cast<const PairVisitor*>(data))(numberOf(first), numberOf(second));
}

}  // namespace

OdeSpacePeer::OdeSpacePeer(bool with_bodies) : world_(with_bodies ? dWorldCreate() : nullptr) {}

OdeSpacePeer::~OdeSpacePeer() {
  // Out of the space from the last to the first: the order that every space is quick at.
  if (space_) {
    dSpaceSetCleanup(space_, 0);
    dSpaceDestroy(space_);
  }
  for (dGeomID geom : geoms_) dGeomDestroy(geom);
  if (world_) dWorldDestroy(world_);
}

void OdeSpacePeer::create(const Boxes& boxes) {
  extent_ = extentOf(boxes);
  geoms_.reserve(boxes.size());
  for (const CentredBox& box : boxes) {
    const dGeomID geom = dCreateBox(nullptr, 2 * box.half[0], 2 * box.half[1], 2 * box.half[2]);
    dGeomSetData(geom, reinterpret_cast<void*>(geoms_.size()));
    if (world_) dGeomSetBody(geom, dBodyCreate(world_));
    dGeomSetPosition(geom, box.centre[0], box.centre[1], box.centre[2]);
    geoms_.push_back(geom);
  }
  shown_ = boxes;
}

void OdeSpacePeer::enter() {
  space_ = createSpace(extent_, geoms_.size());
  for (dGeomID geom : geoms_) dSpaceAdd(space_, geom);
}

void OdeSpacePeer::move(const Boxes& boxes) {
  for (std::size_t i = 0; i < geoms_.size(); ++i) {
    const CentredBox& box = boxes[i];
    const bool moves = !(box == shown_[i]);
    if (world_) {
      const dBodyID body = dGeomGetBody(geoms_[i]);
      if (moves && !dBodyIsEnabled(body)) woke(geoms_[i]);
      (moves ? dBodyEnable : dBodyDisable)(body);
    }
    if (!moves) continue;
    if (!box.sameSizeAs(shown_[i]))
      dGeomBoxSetLengths(geoms_[i], 2 * box.half[0], 2 * box.half[1], 2 * box.half[2]);
    shown_[i] = box;
    dGeomSetPosition(geoms_[i], box.centre[0], box.centre[1], box.centre[2]);
  }
}

std::size_t OdeSpacePeer::find() {
  std::size_t pairs = 0;
  dSpaceCollide(space_, &pairs, countPair);
  return pairs;
}

void OdeSpacePeer::visit(const PairVisitor& visitor) {
  dSpaceCollide(space_, const_cast<PairVisitor*>(&visitor), tell);
}

std::string odeVersion() {
  return std::string("ODE " BENCH_ODE_VERSION ", ") +
         (sizeof(dReal) == sizeof(double) ? "double" : "single") + " precision";
}

}  // namespace bench
