// Sixteen lanes as four NEON registers: every 64-bit ARM processor.
#pragma once

#include <arm_neon.h>

#include <cstddef>
#include <cstdint>

#include "space/simd/lanes_common.h"

namespace {

// compress_bytes.of[m] takes the words of a register whose bits are set in m to its front;
// compress_bytes.count[m] is their number.
struct CompressBytes {
  alignas(16) std::uint8_t of[16][16];
  std::uint8_t count[16];
  constexpr CompressBytes() : of(), count() {
    for (int m = 0; m < 16; ++m) {
      int bytes = 0;
      for (int i = 0; i < 16; ++i)
        if (m >> (i / 4) & 1) of[m][bytes++] = static_cast<std::uint8_t>(i);
      count[m] = static_cast<std::uint8_t>(bytes / 4);
    }
  }
};
constexpr CompressBytes compress_bytes;

struct Lanes {
  static constexpr const char* name = "neon";

  static unsigned atLeast(const float* p, float value) {
    const float32x4_t v = vdupq_n_f32(value);
    return eachOf(p, [=](float32x4_t four) { return vcgeq_f32(four, v); });
  }
  static unsigned atMost(const float* p, float value) {
    const float32x4_t v = vdupq_n_f32(value);
    return eachOf(p, [=](float32x4_t four) { return vcleq_f32(four, v); });
  }
  static unsigned atLeast(const double* p, double value) {
    const float64x2_t v = vdupq_n_f64(value);
    return eachOf(p, [=](float64x2_t two) { return vcgeq_f64(two, v); });
  }
  static unsigned atMost(const double* p, double value) {
    const float64x2_t v = vdupq_n_f64(value);
    return eachOf(p, [=](float64x2_t two) { return vcleq_f64(two, v); });
  }
  template <class Real>
  struct Row;

  static unsigned sharesBits(const std::uint32_t* p, std::uint32_t value) {
    const uint32x4_t v = vdupq_n_u32(value);
    return eachOf(p, [=](uint32x4_t four) { return vtstq_u32(four, v); });
  }
  static unsigned below(const std::uint32_t* p, std::uint32_t value) {
    const uint32x4_t v = vdupq_n_u32(value);
    return eachOf(p, [=](uint32x4_t four) { return vcltq_u32(four, v); });
  }
  static unsigned equals(const std::uint32_t* p, std::uint32_t value) {
    const uint32x4_t v = vdupq_n_u32(value);
    return eachOf(p, [=](uint32x4_t four) { return vceqq_u32(four, v); });
  }
  static void compress(const std::uint32_t* p, unsigned mask, std::uint32_t* out) {
    for (; mask; mask >>= 4, p += 4) {
      vst1q_u32(out, toFront(vld1q_u32(p), mask & 0xf));
      out += compress_bytes.count[mask & 0xf];
    }
  }
  static void compress(const float* p, unsigned mask, float* out) {
    for (; mask; mask >>= 4, p += 4) {
      vst1q_f32(out,
                vreinterpretq_f32_u32(toFront(vreinterpretq_u32_f32(vld1q_f32(p)), mask & 0xf)));
      out += compress_bytes.count[mask & 0xf];
    }
  }
  static void compress(const double* p, unsigned mask, double* out) {
    ScalarLanes::compress(p, mask, out);
  }
  static void writeNumbers(std::uint32_t first, unsigned mask, std::uint32_t* out) {
    constexpr std::uint32_t lanes[] = {0, 1, 2, 3};
    uint32x4_t numbers = vaddq_u32(vdupq_n_u32(first), vld1q_u32(lanes));
    for (; mask; mask >>= 4, numbers = vaddq_u32(numbers, vdupq_n_u32(4))) {
      vst1q_u32(out, toFront(numbers, mask & 0xf));
      out += compress_bytes.count[mask & 0xf];
    }
  }
  static int writePairs(const std::uint32_t* slots, std::uint32_t slot, unsigned mask,
                        std::uint64_t* out) {
    const std::uint64_t* const begin = out;
    const uint32x4_t own = vdupq_n_u32(slot);
    for (; mask; mask >>= 4, slots += 4) {
      if (!(mask & 0xf)) continue;
      const uint32x4_t other = toFront(vld1q_u32(slots), mask & 0xf);
      const uint32x4_t earlier = vminq_u32(own, other), later = vmaxq_u32(own, other);
      vst1q_u64(out, vreinterpretq_u64_u32(vzip1q_u32(later, earlier)));
      vst1q_u64(out + 2, vreinterpretq_u64_u32(vzip2q_u32(later, earlier)));
      out += compress_bytes.count[mask & 0xf];
    }
    return static_cast<int>(out - begin);
  }
  // Of a number and a NaN these instructions take the number.
  static float least(const float* p) {
    return vminnmvq_f32(vminnmq_f32(vminnmq_f32(vld1q_f32(p), vld1q_f32(p + 4)),
                                    vminnmq_f32(vld1q_f32(p + 8), vld1q_f32(p + 12))));
  }
  static float greatest(const float* p) {
    return vmaxnmvq_f32(vmaxnmq_f32(vmaxnmq_f32(vld1q_f32(p), vld1q_f32(p + 4)),
                                    vmaxnmq_f32(vld1q_f32(p + 8), vld1q_f32(p + 12))));
  }
  static double least(const double* p) {
    float64x2_t v = vld1q_f64(p);
    for (int i = 2; i < 16; i += 2) v = vminnmq_f64(v, vld1q_f64(p + i));
    return vminnmvq_f64(v);
  }
  static double greatest(const double* p) {
    float64x2_t v = vld1q_f64(p);
    for (int i = 2; i < 16; i += 2) v = vmaxnmq_f64(v, vld1q_f64(p + i));
    return vmaxnmvq_f64(v);
  }

 private:
  // Bit i: lane i of the four registers is all ones; all others are zero.
  static unsigned bits(uint32x4_t a, uint32x4_t b, uint32x4_t c, uint32x4_t d) {
    constexpr std::uint32_t weights[] = {1, 2, 4, 8};
    // a + 16 b + 256 c + 4096 d, lane by lane: each register brings in bits of its own.
    const uint32x4_t weight = vld1q_u32(weights);
    uint32x4_t sum = vandq_u32(a, weight);
    sum = vorrq_u32(sum, vandq_u32(b, vshlq_n_u32(weight, 4)));
    sum = vorrq_u32(sum, vandq_u32(c, vshlq_n_u32(weight, 8)));
    sum = vorrq_u32(sum, vandq_u32(d, vshlq_n_u32(weight, 12)));
    return vaddvq_u32(sum);
  }
  static uint32x4_t narrow(uint64x2_t a, uint64x2_t b) {
    return vuzp1q_u32(vreinterpretq_u32_u64(a), vreinterpretq_u32_u64(b));
  }

  template <class Test>
  static unsigned eachOf(const std::uint32_t* p, Test test) {
    return bits(test(vld1q_u32(p)), test(vld1q_u32(p + 4)), test(vld1q_u32(p + 8)),
                test(vld1q_u32(p + 12)));
  }
  template <class Test>
  static unsigned eachOf(const float* p, Test test) {
    return bits(test(vld1q_f32(p)), test(vld1q_f32(p + 4)), test(vld1q_f32(p + 8)),
                test(vld1q_f32(p + 12)));
  }
  template <class Test>
  static unsigned eachOf(const double* p, Test test) {
    const auto four = [=](int i) {
      return narrow(test(vld1q_f64(p + i)), test(vld1q_f64(p + i + 2)));
    };
    return bits(four(0), four(4), four(8), four(12));
  }
  // Which of four boxes reach from `lowest` to `highest` on an axis.
  static uint32x4_t reaching(const float* lower, const float* upper, float lowest, float highest) {
    return vandq_u32(vcgeq_f32(vld1q_f32(upper), vdupq_n_f32(lowest)),
                     vcleq_f32(vld1q_f32(lower), vdupq_n_f32(highest)));
  }
  static uint32x4_t reaching(const double* lower, const double* upper, double lowest,
                             double highest) {
    const auto two = [=](int i) {
      return vandq_u64(vcgeq_f64(vld1q_f64(upper + i), vdupq_n_f64(lowest)),
                       vcleq_f64(vld1q_f64(lower + i), vdupq_n_f64(highest)));
    };
    return narrow(two(0), two(2));
  }
  // The words of `v` in `mask`, of four bits, low ones first.
  static uint32x4_t toFront(uint32x4_t v, unsigned mask) {
    return vreinterpretq_u32_u8(
        vqtbl1q_u8(vreinterpretq_u8_u32(v), vld1q_u8(compress_bytes.of[mask])));
  }
};

// Sixteen boxes, read from memory each time: 24 registers would leave too few for the tests.
template <class Real>
struct Lanes::Row {
  const Real *lower, *upper;
  std::size_t stride;

  Row(const Real* lower, const Real* upper, std::size_t stride)
      : lower(lower), upper(upper), stride(stride) {}
  // Which of them overlap a box, as closed intervals. Lanes are made bits once, after all tests.
  template <class BoxGroup>
  unsigned overlapping(const BoxGroup& box, unsigned lane) const {
    const auto four = [&](int first) {
      uint32x4_t inside = vdupq_n_u32(~0u);
      for (int axis = 0; axis < 3; ++axis) {
        const std::size_t at = axis * stride + first;
        inside = vandq_u32(
            inside, reaching(lower + at, upper + at, box.lower[axis][lane], box.upper[axis][lane]));
      }
      return inside;
    };
    return bits(four(0), four(4), four(8), four(12));
  }
};

}  // namespace
