// Sixteen lanes in plain C++, for processors without one of the other sets.
#pragma once

#include <cstddef>
#include <cstdint>

#include "space/simd/lanes_common.h"

namespace {

struct Lanes : ScalarLanes {
  static constexpr const char* name = "portable";

  // Which of p[0..15] are at least `value`.
  template <class Real>
  static unsigned atLeast(const Real* p, Real value) {
    unsigned mask = 0;
    for (int i = 0; i < 16; ++i) mask |= unsigned{p[i] >= value} << i;
    return mask;
  }
  // Which of p[0..15] are at most `value`.
  template <class Real>
  static unsigned atMost(const Real* p, Real value) {
    unsigned mask = 0;
    for (int i = 0; i < 16; ++i) mask |= unsigned{p[i] <= value} << i;
    return mask;
  }
  template <class Real>
  using Row = RowByPointer<Lanes, Real>;

  static unsigned sharesBits(const std::uint32_t* p, std::uint32_t value) {
    unsigned mask = 0;
    for (int i = 0; i < 16; ++i) mask |= unsigned{(p[i] & value) != 0} << i;
    return mask;
  }
  // Which of p[0..15] are below `value`; all are below 2^31.
  static unsigned below(const std::uint32_t* p, std::uint32_t value) {
    unsigned mask = 0;
    for (int i = 0; i < 16; ++i) mask |= unsigned{p[i] < value} << i;
    return mask;
  }
  static unsigned equals(const std::uint32_t* p, std::uint32_t value) {
    unsigned mask = 0;
    for (int i = 0; i < 16; ++i) mask |= unsigned{p[i] == value} << i;
    return mask;
  }
};

}  // namespace
