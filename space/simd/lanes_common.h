// What several sets of lanes share. Internal linkage, as in kernels_impl.h.
#ifndef ODE_PARALLEL_SAP_SIMD_LANES_COMMON_H
#define ODE_PARALLEL_SAP_SIMD_LANES_COMMON_H

#include <cstddef>

namespace {

// Sixteen boxes to be tested against many, read from memory each time: for sets that have no
// registers to keep them in.
template <class Set, class Real>
struct RowByPointer {
  const Real *lower, *upper;
  std::size_t stride;

  RowByPointer(const Real* lower, const Real* upper, std::size_t stride)
      : lower(lower), upper(upper), stride(stride) {}
  // Which of them overlap a box, as closed intervals.
  template <class BoxGroup>
  unsigned overlapping(const BoxGroup& box, unsigned lane) const {
    unsigned mask = 0xffff;
    for (int axis = 0; axis < 3; ++axis)
      mask &= Set::atLeast(upper + axis * stride, box.lower[axis][lane]) &
              Set::atMost(lower + axis * stride, box.upper[axis][lane]);
    return mask;
  }
};

// The least and the greatest of sixteen, NaN apart; NaN where all are.
template <class Real>
inline Real scalarLeast(const Real* p) {
  Real least = p[0];
  for (int i = 1; i < 16; ++i) least = p[i] < least || least != least ? p[i] : least;
  return least;
}
template <class Real>
inline Real scalarGreatest(const Real* p) {
  Real greatest = p[0];
  for (int i = 1; i < 16; ++i) greatest = p[i] > greatest || greatest != greatest ? p[i] : greatest;
  return greatest;
}

}  // namespace

#endif
