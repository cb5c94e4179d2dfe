// Sixteen lanes as four NEON registers: every 64-bit ARM processor.
#include <arm_neon.h>

#include <cstddef>
#include <cstdint>

#include "space/simd/lanes_common.h"

namespace {

struct Lanes : RegisterLanes<Lanes> {
  static constexpr const char* name = "neon";

  // Bit i: lane i of those that test() fills is all ones; all others are zero.
  template <class T, class Test>
  [[gnu::always_inline]] static unsigned bits(Test test) {
    constexpr std::uint32_t weights[] = {1, 2, 4, 8};
    const uint32x4_t weight = vld1q_u32(weights);
    uint32x4_t sum = {};
    // Lane by lane: each register brings in bits of its own.
    for (int i = 0; i < 16; i += 4) {
      uint32x4_t lanes = reinterpret_cast<uint32x4_t>(test(i));
      if constexpr (sizeof(T) == 8)
        lanes = vuzp1q_u32(lanes, reinterpret_cast<uint32x4_t>(test(i + 2)));
      sum |= lanes & (weight << i);
    }
    return vaddvq_u32(sum);
  }

  using RegisterLanes::compress;
  template <int rows>
  static void compress(const float* p, std::size_t stride, unsigned mask, float* out,
                       std::size_t out_stride) {
    for (; mask; mask >>= 4, p += 4) {
      const uint32x4_t lanes = vld1q_u32(four_lanes.lanes[mask % 16]) * 0x04040404 + 0x03020100;
      for (int row = 0; row < rows; ++row)
        vst1q_u8(reinterpret_cast<std::uint8_t*>(out + row * out_stride),
                 vqtbl1q_u8(reinterpret_cast<uint8x16_t>(load(p + row * stride)),
                            vreinterpretq_u8_u32(lanes)));
      out += four_lanes.count[mask % 16];
    }
  }
};

}  // namespace

#include "space/simd/kernels_impl.h"

const KernelSet ode_parallel_sap::kernels_neon = kernel_set;
