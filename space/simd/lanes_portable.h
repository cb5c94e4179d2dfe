// Sixteen lanes in plain C++, for processors without one of the other sets.
#ifndef ODE_PARALLEL_SAP_SIMD_LANES_PORTABLE_H
#define ODE_PARALLEL_SAP_SIMD_LANES_PORTABLE_H

#include <cstddef>
#include <cstdint>

#include "space/simd/lanes_common.h"

namespace {

struct Lanes {
  static constexpr const char* name = "portable";
  static constexpr bool sorts_eight = false;

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
  // Writes the elements of p[0..15] in `mask`, in order. Writes at most 16; how many count is the
  // number of bits.
  template <class T>
  static void compress(const T* p, unsigned mask, T* out) {
    for (; mask; mask &= mask - 1) *out++ = p[__builtin_ctz(mask)];
  }
  // Writes `first` + i for each bit i of `mask`, in order. Writes at most 16 numbers.
  static void writeNumbers(std::uint32_t first, unsigned mask, std::uint32_t* out) {
    for (; mask; mask &= mask - 1) *out++ = first + static_cast<std::uint32_t>(__builtin_ctz(mask));
  }
  // Writes a word for each lane in `mask`, low lanes first: the smaller of its slot and `slot` on
  // top of the larger one. Writes at most 16 words; returns the number that count.
  static int writePairs(const std::uint32_t* slots, std::uint32_t slot, unsigned mask,
                        std::uint64_t* out) {
    int count = 0;
    for (; mask; mask &= mask - 1) {
      const std::uint32_t other = slots[__builtin_ctz(mask)];
      out[count++] =
          slot < other ? std::uint64_t{slot} << 32 | other : std::uint64_t{other} << 32 | slot;
    }
    return count;
  }
  template <class Real>
  static Real least(const Real* p) {
    return scalarLeast(p);
  }
  template <class Real>
  static Real greatest(const Real* p) {
    return scalarGreatest(p);
  }
};

}  // namespace

#endif
