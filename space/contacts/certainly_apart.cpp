#include "space/base/floating_point.h"
#include "space/contacts/narrow_phase.h"
#include "space/geoms/ode_private.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

bool isKnownBox(const dxGeom* geom) {
  return geom->type == dBoxClass && !(geom->gflags & GEOM_POSR_BAD);
}

void put(const dxGeom* geom, int which, int lane, BoxPairs<dReal>& boxes) {
  boxes.centre[which][lane] = geom->final_posr->pos;
  boxes.matrix[which][lane] = geom->final_posr->R;
  boxes.sides[which][lane] = static_cast<const dxBox*>(geom)->side;
}

}  // namespace

// Numbers beyond floats become infinite, and must not trap where the program wants that of its own.
ApartBoxes certainlyApart(const dParallelSAPPair* pairs, std::size_t count, std::uint32_t wanted) {
  const ScopedMode scoped(exactMode());
  ApartBoxes found = {};
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t bit = std::uint32_t{1} << i;
    if (wanted & bit && isKnownBox(pairs[i].o1) && isKnownBox(pairs[i].o2)) found.tested |= bit;
  }
  for (std::uint32_t rest = found.tested; rest;) {
    BoxPairs<dReal> boxes;
    std::uint32_t bits[group_size];
    int used = 0;
    // What is left of the lanes repeats the last pair.
    for (int lane = 0; lane < group_size; ++lane) {
      if (rest) bits[used++] = rest & -rest;
      rest &= rest - 1;
      const dParallelSAPPair& pair = pairs[__builtin_ctz(bits[used - 1])];
      put(pair.o1, 0, lane, boxes);
      put(pair.o2, 1, lane, boxes);
    }
    unsigned lanes = kernels<dReal>().boxesApart(boxes) & ((1u << used) - 1);
    for (; lanes; lanes &= lanes - 1) found.apart |= bits[__builtin_ctz(lanes)];
  }
  return found;
}

}  // namespace ode_parallel_sap
