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

BallShape ballOf(const dxGeom* geom) {
  return {geom->final_posr->pos, static_cast<const dxSphere*>(geom)->radius};
}
RodShape rodOf(const dxGeom* geom) {
  const dxCapsule* const capsule = static_cast<const dxCapsule*>(geom);
  return {geom->final_posr->pos, geom->final_posr->R, capsule->radius, capsule->lz};
}
BrickShape brickOf(const dxGeom* geom) {
  return {geom->final_posr->pos, geom->final_posr->R, static_cast<const dxBox*>(geom)->side};
}
HalfSpaceShape halfSpaceOf(const dxGeom* geom) {
  return {static_cast<const dxPlane*>(geom)->p};
}

bool isBallApart(const dxGeom* ball, const dxGeom* other) {
  switch (other->type) {
    case dSphereClass:
      return areApart(ballOf(ball), ballOf(other));
    case dBoxClass:
      return areApart(ballOf(ball), brickOf(other));
    case dPlaneClass:
      return areApart(ballOf(ball), halfSpaceOf(other));
    default:
      return areApart(rodOf(other), ballOf(ball));
  }
}

bool isRodApart(const dxGeom* rod, const dxGeom* other) {
  switch (other->type) {
    case dBoxClass:
      return areApart(rodOf(rod), brickOf(other));
    case dPlaneClass:
      return areApart(rodOf(rod), halfSpaceOf(other));
    default:
      return areApart(rodOf(rod), rodOf(other));
  }
}

// For all of the known classes but two boxes. ODE has no collider of two planes.
bool isPairApart(const dxGeom* a, const dxGeom* b) {
  if (a->type == dSphereClass) return isBallApart(a, b);
  if (b->type == dSphereClass) return isBallApart(b, a);
  if (a->type == dCapsuleClass) return isRodApart(a, b);
  if (b->type == dCapsuleClass) return isRodApart(b, a);
  if (a->type == dBoxClass) return areApart(brickOf(a), halfSpaceOf(b));
  return b->type == dBoxClass && areApart(brickOf(b), halfSpaceOf(a));
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
