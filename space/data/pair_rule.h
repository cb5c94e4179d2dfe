// What still decides about a pair of overlapping boxes: filters, and whether floats can be trusted.
#ifndef ODE_PARALLEL_SAP_PAIR_RULE_H
#define ODE_PARALLEL_SAP_PAIR_RULE_H

#include <cstdint>
#include <cstring>

#include "space/data/box_set.h"
#include "space/data/pair_list.h"

namespace ode_parallel_sap {

// Numbers the floats by steps, the two zeros being one.
inline std::int32_t stepNumber(float value) {
  std::int32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  const std::int32_t sign = bits >> 31;
  return ((bits & 0x7fffffff) ^ sign) - sign;
}

// Whether only the exact boxes can tell that two overlap whose float bounds do: one bound shrunk by
// two steps would pass the other. Each exact bound is less than one step inside its float.
inline bool isUnsure(const BasicBox<float>& a, const BasicBox<float>& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (stepNumber(a.lower[axis]) + 2 > stepNumber(b.upper[axis]) ||
        stepNumber(b.lower[axis]) + 2 > stepNumber(a.upper[axis]))
      return true;
  return false;
}
// Doubles are the exact bounds.
inline bool isUnsure(const BasicBox<double>&, const BasicBox<double>&) {
  return false;
}

inline bool passesFilters(const BoxSet& boxes, Slot a, Slot b) {
  if (boxes.filter_bits && !(boxes.bits[a].category & boxes.bits[b].collide) &&
      !(boxes.bits[b].category & boxes.bits[a].collide))
    return false;
  return !boxes.filter_bodies || !boxes.bodies[a] || boxes.bodies[a] != boxes.bodies[b];
}

// Writes the pair of two slots whose boxes overlap, if it passes the filters, to *to. Returns what
// comes after it.
template <class Real>
inline Pair* writePair(const BoxSet& boxes, Slot a, Slot b, Pair* to) {
  if (!passesFilters(boxes, a, b)) return to;
  *to = a < b ? makePair(a, b) : makePair(b, a);
  if (!boxes.exact && isUnsure(boxesOf<Real>(boxes)[a], boxesOf<Real>(boxes)[b])) *to |= unsure_bit;
  return to + 1;
}

}  // namespace ode_parallel_sap

#endif
