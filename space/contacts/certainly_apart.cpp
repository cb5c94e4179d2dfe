#include "space/contacts/certainly_apart.h"

#include "space/contacts/apart_shapes.h"
#include "space/data/floating_point.h"
#include "space/geom/ode_private.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

using namespace apart_shapes;

bool isKnown(const dxGeom* geom) {
  constexpr unsigned known =
      1u << dSphereClass | 1u << dBoxClass | 1u << dCapsuleClass | 1u << dPlaneClass;
  return geom->type < 32 && known >> geom->type & 1 && !(geom->gflags & GEOM_POSR_BAD);
}

Vector vectorOf(const dReal* v) {
  return {v[0], v[1], v[2]};
}
Vector centreOf(const dxGeom* geom) {
  return vectorOf(geom->final_posr->pos);
}
// Axes are columns of a matrix of three rows of four numbers each.
Vector axisOf(const dxGeom* geom, int axis) {
  const dReal* const matrix = geom->final_posr->R;
  return {matrix[axis], matrix[4 + axis], matrix[8 + axis]};
}

SphereShape sphereOf(const dxGeom* geom) {
  return {centreOf(geom), static_cast<const dxSphere*>(geom)->radius};
}
CapsuleShape capsuleOf(const dxGeom* geom) {
  const dxCapsule* const capsule = static_cast<const dxCapsule*>(geom);
  return {centreOf(geom), axisOf(geom, 2), 0.5 * capsule->lz, capsule->radius};
}
BoxShape boxOf(const dxGeom* geom) {
  const dReal* const side = static_cast<const dxBox*>(geom)->side;
  return {centreOf(geom),
          {axisOf(geom, 0), axisOf(geom, 1), axisOf(geom, 2)},
          {0.5 * side[0], 0.5 * side[1], 0.5 * side[2]}};
}
PlaneShape planeOf(const dxGeom* geom) {
  const dReal* const p = static_cast<const dxPlane*>(geom)->p;
  return {vectorOf(p), p[3]};
}

bool isSphereApart(const dxGeom* sphere, const dxGeom* other) {
  switch (other->type) {
    case dSphereClass:
      return areApart(sphereOf(sphere), sphereOf(other));
    case dBoxClass:
      return areApart(sphereOf(sphere), boxOf(other));
    case dPlaneClass:
      return areApart(sphereOf(sphere), planeOf(other));
    default:
      return areApart(capsuleOf(other), sphereOf(sphere));
  }
}

bool isCapsuleApart(const dxGeom* capsule, const dxGeom* other) {
  switch (other->type) {
    case dBoxClass:
      return areApart(capsuleOf(capsule), boxOf(other));
    case dPlaneClass:
      return areApart(capsuleOf(capsule), planeOf(other));
    default:
      return areApart(capsuleOf(capsule), capsuleOf(other));
  }
}

// For all of the known classes but two boxes. ODE has no collider of two planes.
bool isPairApart(const dxGeom* a, const dxGeom* b) {
  if (a->type == dSphereClass) return isSphereApart(a, b);
  if (b->type == dSphereClass) return isSphereApart(b, a);
  if (a->type == dCapsuleClass) return isCapsuleApart(a, b);
  if (b->type == dCapsuleClass) return isCapsuleApart(b, a);
  if (a->type == dBoxClass) return areApart(boxOf(a), planeOf(b));
  return b->type == dBoxClass && areApart(boxOf(b), planeOf(a));
}

// Pairs of boxes wait here for each other.
class BoxBatch {
 public:
  // Adds pair number `pair`; returns those of a full batch that are apart, by bits.
  std::uint32_t add(const dxGeom* a, const dxGeom* b, std::size_t pair) {
    put(a, 0);
    put(b, 1);
    pairs_[count_] = static_cast<std::uint8_t>(pair);
    return ++count_ == group_size ? takeApart() : 0;
  }
  std::uint32_t takeApart() {
    if (count_ == 0) return 0;
    fillUp();
    unsigned lanes = kernels<dReal>().boxesApart(boxes_) & ((1u << count_) - 1);
    std::uint32_t apart = 0;
    for (; lanes; lanes &= lanes - 1) apart |= std::uint32_t{1} << pairs_[__builtin_ctz(lanes)];
    count_ = 0;
    return apart;
  }

 private:
  void put(const dxGeom* geom, int which) {
    boxes_.centre[which][count_] = geom->final_posr->pos;
    boxes_.matrix[which][count_] = geom->final_posr->R;
    boxes_.sides[which][count_] = static_cast<const dxBox*>(geom)->side;
  }
  // With the first pair, again and again.
  void fillUp() {
    for (int which = 0; which < 2; ++which)
      for (int lane = count_; lane < group_size; ++lane) {
        boxes_.centre[which][lane] = boxes_.centre[which][0];
        boxes_.matrix[which][lane] = boxes_.matrix[which][0];
        boxes_.sides[which][lane] = boxes_.sides[which][0];
      }
  }

  BoxPairs<dReal> boxes_;
  std::uint8_t pairs_[group_size];
  int count_ = 0;
};

}  // namespace

// Numbers beyond floats become infinite, and must not trap where the program wants that of its own.
ApartPairs certainlyApart(const dParallelSAPPair* pairs, std::size_t count, std::uint32_t wanted,
                          ApartKinds kinds) {
  const ScopedMode scoped(exactMode());
  BoxBatch boxes;
  ApartPairs found = {};
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t bit = std::uint32_t{1} << i;
    const dxGeom *const a = pairs[i].o1, *const b = pairs[i].o2;
    if (!(wanted & bit) || !isKnown(a) || !isKnown(b)) continue;
    if (a->type == dBoxClass && b->type == dBoxClass) {
      if (!kinds.boxes) continue;
      found.boxes |= bit;
      found.apart |= boxes.add(a, b, i);
    } else if (kinds.others) {
      found.others |= bit;
      if (isPairApart(a, b)) found.apart |= bit;
    }
  }
  found.apart |= boxes.takeApart();
  return found;
}

}  // namespace ode_parallel_sap
