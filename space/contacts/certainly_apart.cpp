#include "space/contacts/certainly_apart.h"

#include "space/base/floating_point.h"
#include "space/geoms/ode_private.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

bool isKnownBox(const dxGeom* geom) {
  return geom->type == dBoxClass && !(geom->gflags & GEOM_POSR_BAD);
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
ApartBoxes certainlyApart(const dParallelSAPPair* pairs, std::size_t count, std::uint32_t wanted) {
  const ScopedMode scoped(exactMode());
  BoxBatch boxes;
  ApartBoxes found = {};
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t bit = std::uint32_t{1} << i;
    const dxGeom *const a = pairs[i].o1, *const b = pairs[i].o2;
    if (!(wanted & bit) || !isKnownBox(a) || !isKnownBox(b)) continue;
    found.tested |= bit;
    found.apart |= boxes.add(a, b, i);
  }
  found.apart |= boxes.takeApart();
  return found;
}

}  // namespace ode_parallel_sap
