// Sixteen lanes as four NEON registers: every 64-bit ARM processor.
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

struct Lanes : RegisterLanes<Lanes> {
  static constexpr const char* name = "neon";

  // Bit i: lane i of those that test() fills is all ones; all others are zero.
  template <class T, class Test>
  [[gnu::always_inline]] static unsigned bits(Test test) {
    constexpr std::uint32_t weights[] = {1, 2, 4, 8};
    const uint32x4_t weight = vld1q_u32(weights);
    uint32x4_t sum = {};
    // Lane by lane: each register brings in bits of its own.
    for (int i = 0; i < 16; i += 4) sum |= four<T>(test, i) & (weight << i);
    return vaddvq_u32(sum);
  }

  template <class T>
  static void compress(const T* p, unsigned mask, T* out) {
    static_assert(sizeof(T) == 4, "lanes are words");
    for (; mask; mask >>= 4, p += 4) {
      vst1q_u8(reinterpret_cast<std::uint8_t*>(out),
               toFront(reinterpret_cast<uint32x4_t>(load(p)), mask & 0xf));
      out += compress_bytes.count[mask & 0xf];
    }
  }
  static void compress(const double* p, unsigned mask, double* out) {
    RegisterLanes::compress(p, mask, out);
  }
  static void writeNumbers(std::uint32_t first, unsigned mask, std::uint32_t* out) {
    constexpr std::uint32_t lanes[] = {0, 1, 2, 3};
    uint32x4_t numbers = vaddq_u32(vdupq_n_u32(first), vld1q_u32(lanes));
    for (; mask; mask >>= 4, numbers = vaddq_u32(numbers, vdupq_n_u32(4))) {
      vst1q_u8(reinterpret_cast<std::uint8_t*>(out), toFront(numbers, mask & 0xf));
      out += compress_bytes.count[mask & 0xf];
    }
  }

 private:
  template <class T, class Test>
  [[gnu::always_inline]] static uint32x4_t four(Test test, int i) {
    if constexpr (sizeof(T) == 4)
      return reinterpret_cast<uint32x4_t>(test(i));
    else
      return vuzp1q_u32(reinterpret_cast<uint32x4_t>(test(i)),
                        reinterpret_cast<uint32x4_t>(test(i + 2)));
  }
  // The words of `v` in `mask`, of four bits, low ones first.
  static uint8x16_t toFront(uint32x4_t v, unsigned mask) {
    return vqtbl1q_u8(vreinterpretq_u8_u32(v), vld1q_u8(compress_bytes.of[mask]));
  }
};

}  // namespace

// The kernels for these lanes.
#include "space/simd/kernels_impl.h"

const KernelSet ode_parallel_sap::kernels_neon = kernel_set;
