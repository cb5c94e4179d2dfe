// ODE's tests on a geom. Those on pairs of geoms are in pair_rule.h.
#pragma once

#include <ode/ode.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "space/base/both_sides.h"
#include "space/base/floating_point.h"
#include "space/base/platform.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

inline bool isUserClass(const dxGeom* geom) {
  return geom->type >= dFirstUserClass && geom->type <= dLastUserClass;
}

// The user's classes that the program has declared to have no AABBTest, a bit each: ODE has no
// function that says which have one.
inline std::atomic<unsigned> untested_classes{0};
static_assert(dMaxUserClasses <= 32, "a bit each");

// Whether a geom's AABBTest has to be called. Those of ODE's own classes accept every pair.
inline bool hasAABBTest(const dxGeom* geom) {
  return isUserClass(geom) &&
         !(untested_classes.load(std::memory_order_relaxed) >> (geom->type - dFirstUserClass) & 1);
}

// Meshes of GIMPACT carry work data that it locks and updates. Those of OPCODE are only read.
inline bool meshesAreRead() {
  static const bool are = dCheckConfiguration("ODE_EXT_gimpact") == 0;
  return are;
}

// Whether other threads may not compute other geoms' AABBs at the same time: where user code runs,
// where a sub-space cleans its geoms, or where geoms share caches.
inline bool needsCallingThread(const dxGeom* geom) {
  if (geom->type < dGeomTransformClass) return false;
  return IS_SPACE(geom) || isUserClass(geom) || geom->type == dGeomTransformClass ||
         (geom->type == dTriMeshClass && !meshesAreRead());
}

// Whether a space holds nothing but spaces, at any depth. The sorting spaces of older forks of ODE
// keep their geoms in no list.
inline bool holdsNoGeom(const dxSpace* space) {
  if (!space->first) return space->count == 0;
  for (const dxGeom* geom = space->first; geom; geom = geom->next)
    if (!IS_SPACE(geom) || !holdsNoGeom(static_cast<const dxSpace*>(geom))) return false;
  return true;
}
inline bool isEmpty(const dxSpace* space) {
  return (!space->first || IS_SPACE(space->first)) && holdsNoGeom(space);
}

// Enabled, not zero-sized and not an empty sub-space.
inline bool isEnabled(const dxGeom* geom) {
  return (geom->gflags & GEOM_ENABLE_TEST_MASK) == GEOM_ENABLE_TEST_VALUE &&
         !(IS_SPACE(geom) && isEmpty(static_cast<const dxSpace*>(geom)));
}

using BoundBits = std::conditional<sizeof(dReal) == 8, std::uint64_t, std::uint32_t>::type;
inline BoundBits bitsOfBound(dReal bound) {
  return static_cast<BoundBits>(bitsOf(bound));
}

// As integers without their signs: to compare a signalling NaN may trap. Most geoms have no bound
// of the greatest exponent, to which one more would become a sign.
inline bool hasNaN(const dxGeom* geom) {
  const BoundBits infinity = bitsOfBound(std::numeric_limits<dReal>::infinity()) << 1;
  constexpr BoundBits sign = BoundBits{1} << (8 * sizeof(BoundBits) - 1);
  BoundBits greatest = 0;
  for (int i = 0; i < 6; ++i)
    greatest |= (bitsOfBound(geom->aabb[i]) & ~sign) + (sign - infinity / 2);
  if (!(greatest & sign)) return false;
  bool nan = false;
  for (int i = 0; i < 6; ++i) nan |= (bitsOfBound(geom->aabb[i]) << 1) > infinity;
  return nan;
}

// False for NaN and unbounded geoms and for extents beyond the type: few instructions for the many.
// Needs exactMode(): the differences may overflow, which is no business of a program that traps it.
inline bool isPlain(const dxGeom* geom) {
  // As integers, negative numbers, infinities and NaN are above all others.
  const dReal* const bounds = geom->aabb;
  const BoundBits infinity = bitsOfBound(std::numeric_limits<dReal>::infinity());
  const BoundBits most =
      std::max(std::max(bitsOfBound(bounds[1] - bounds[0]), bitsOfBound(bounds[3] - bounds[2])),
               bitsOfBound(bounds[5] - bounds[4]));
  return most < infinity;
}

// Makes the box of a ray anew if ODE made NaN of 0 * infinity: it is 0 for an infinite ray across
// an axis. Not inline: comparisons must not come before the class is known, as they may trap.
__attribute__((noinline)) inline void mendBoxOfRay(dxRay& ray) {
  if (!hasNaN(&ray)) return;
  for (int axis = 0; axis < 3; ++axis) {
    const dReal begin = ray.final_posr->pos[axis], along = ray.final_posr->R[4 * axis + 2];
    const dReal end = along == 0 ? begin : begin + along * ray.length;
    const bool forward = begin < end;
    ray.aabb[2 * axis] = forward ? begin : end;
    ray.aabb[2 * axis + 1] = forward ? end : begin;
  }
}

// The one place where boxes of geoms are made that pairs, queries and rays are found by. ODE, or
// the program through dGeomGetAABB, may have made the box already.
inline void updateAABB(dxGeom* geom) {
  geom->recomputeAABB();
  if (geom->type == dRayClass) mendBoxOfRay(*static_cast<dxRay*>(geom));
}

// fixed: a bit of gflags that ODE does not use. ParallelSAPSpace::dirty() sets it, and with
// GEOM_DIRTY it is cleared: the space, and all around it, were told that the geom is dirty.
constexpr int told_dirty = 1 << 25;

// The same of one that is no space, or whose geoms are clean.
inline void cleanOwn(dxGeom* geom) {
  updateAABB(geom);
  geom->gflags &= ~(GEOM_DIRTY | told_dirty);
}
inline void cleanGeom(dxGeom* geom) {
  if (IS_SPACE(geom)) static_cast<dxSpace*>(geom)->cleanGeoms();
  cleanOwn(geom);
}

// All lines of an object, which need not begin with one.
inline void prefetchObject(const void* object, std::size_t size) {
  const char* const bytes = static_cast<const char*>(object);
  for (std::size_t line = 0; line < size; line += 64) prefetch(bytes + line);
  prefetch(bytes + size - 1);
}

// What is read of a geom whose bounds are known; and its bounds.
inline void prefetchState(const dxGeom* geom) {
  prefetch(&geom->gflags);
  prefetch(&geom->body);
  prefetch(&geom->collide_bits);
}
inline void prefetchBounds(const dxGeom* geom) {
  prefetch(&geom->gflags);
  prefetch(geom->aabb);
}

inline void prefetchPose(const dxGeom* geom) {
  if (geom->final_posr) prefetchObject(geom->final_posr, sizeof(dxPosR));
}

// As ODE's dUASSERT, for code that other functions call.
inline void require(bool holds, const char* message, const char* function) {
  if (!holds) dDebug(d_ERR_UASSERT, "%s in %s()", message, function);
}

}  // namespace ode_parallel_sap
