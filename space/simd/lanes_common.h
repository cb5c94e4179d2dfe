// What several sets of lanes share. Internal linkage, as in kernels_impl.h.
#pragma once

#include <string.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace {

#if defined(__AVX512F__)
constexpr int register_bytes = 64;  // fixed: of the vectors
#elif defined(__AVX__)
constexpr int register_bytes = 32;  // fixed: of the vectors
#else
constexpr int register_bytes = 16;  // fixed: of the vectors
#endif

template <class Real>
struct Register {
  static constexpr int lanes = register_bytes / sizeof(Real);
  typedef Real Type __attribute__((vector_size(register_bytes), may_alias));

  // The lesser or greater of both; the second one where one is NaN.
  static Type least(Type a, Type b) { return a < b ? a : b; }
  static Type greatest(Type a, Type b) { return a > b ? a : b; }
};

template <class Real>
struct FourOf {
  typedef Real Type __attribute__((vector_size(4 * sizeof(Real))));
};

// Writes numbers of the vectors x and y, for each four of them by a pattern; 4 to 7 are y's.
constexpr int laneOf(int at, int lanes, int p0, int p1, int p2, int p3) {
  const int from = at % 4 == 0 ? p0 : at % 4 == 1 ? p1 : at % 4 == 2 ? p2 : p3;
  return at / 4 * 4 + from % 4 + (from >= 4 ? lanes : 0);
}
template <int p0, int p1, int p2, int p3, class Vector, int... at>
inline void pick(const Vector& x, const Vector& y, void* to, std::integer_sequence<int, at...>) {
#if defined(__clang__)
  const Vector picked = __builtin_shufflevector(x, y, laneOf(at, sizeof...(at), p0, p1, p2, p3)...);
#else
  const Vector picked =
      __builtin_shuffle(x, y, decltype(x < y){laneOf(at, sizeof...(at), p0, p1, p2, p3)...});
#endif
  memcpy(to, &picked, sizeof picked);
}
template <int p0, int p1, int p2, int p3, class Vector>
inline void pick(const Vector& x, const Vector& y, void* to) {
  pick<p0, p1, p2, p3>(x, y, to, std::make_integer_sequence<int, sizeof(x) / sizeof(x[0])>());
}

// For each mask of four lanes its set bits, low ones first, and their number.
struct FourLanes {
  alignas(16) std::uint32_t lanes[16][4];
  std::uint32_t count[16];
  constexpr FourLanes() : lanes(), count() {
    for (unsigned m = 0; m < 16; ++m)
      for (unsigned i = 0; i < 4; ++i)
        if (m >> i & 1) lanes[m][count[m]++] = i;
  }
};
constexpr FourLanes four_lanes;

// For sets whose comparisons fill the lanes of a register, of which Set::signs() makes bits.
template <class Set>
struct RegisterLanes {
  // Writes the elements of p[0..15] in `mask`, in order, and those of the same lanes of more rows.
  // Writes at most 16 a row; how many count is the number of bits. `out` may be p, or any place
  // before it.
  template <int rows, class T>
  static void compress(const T* p, std::size_t stride, unsigned mask, T* out,
                       std::size_t out_stride) {
    for (; mask; mask &= mask - 1, ++out)
      for (int row = 0; row < rows; ++row)
        out[row * out_stride] = p[row * stride + __builtin_ctz(mask)];
  }
  // Writes `first` + i for each bit i of `mask`, in order: at most 16 numbers; how many count.
  static std::size_t writeNumbers(std::uint32_t first, unsigned mask, std::uint32_t* out) {
    using Four = typename FourOf<std::uint32_t>::Type;
    Four base = Four{} + first;
    std::size_t count = 0;
    for (int i = 0; i < 16; i += 4, mask >>= 4, base += 4) {
      Four numbers;
      memcpy(&numbers, four_lanes.lanes[mask % 16], sizeof numbers);
      numbers += base;
      memcpy(out + count, &numbers, sizeof numbers);
      count += four_lanes.count[mask % 16];
    }
    return count;
  }
  // The least or the greatest of sixteen, NaN apart; NaN where all are.
  template <bool greatest, class Real>
  static Real outermost(const Real* p) {
    typename FourOf<Real>::Type all, other;
    const auto join = [&] {
      all = ((greatest ? all > other : all < other) | (other != other)) ? all : other;
    };
    memcpy(&all, p, sizeof all);
    for (int i = 4; i < 16; i += 4) {
      memcpy(&other, p + i, sizeof other);
      join();
    }
    pick<2, 3, 0, 1>(all, all, &other);
    join();
    pick<1, 0, 3, 2>(all, all, &other);
    join();
    return all[0];
  }
  // Of a comparison: all bits of a lane, or none.
  template <class T>
  using Mask =
      typename Register<std::conditional_t<sizeof(T) == 8, std::int64_t, std::int32_t>>::Type;

  template <class T>
  static typename Register<T>::Type load(const T* p) {
    return *reinterpret_cast<const typename Register<T>::Type*>(p);
  }
  // So many lanes further on than p.
  static typename Register<float>::Type further(const float* p, unsigned by) {
    typename Register<float>::Type numbers;
    memcpy(&numbers, p + by, sizeof numbers);
    return numbers;
  }
  // Bits of sixteen lanes of type T: test(i) compares those of a register from lane i on.
  template <class T, class Test>
  static unsigned bits(Test test) {
    unsigned mask = 0;
    for (int i = 0; i < 16; i += Register<T>::lanes) mask |= Set::signs(test(i)) << i;
    return mask;
  }
  // Which of p[0..15] are at least `value`.
  template <class Real>
  static unsigned atLeast(const Real* p, Real value) {
    return Set::template bits<Real>(
        [=](int i) { return reinterpret_cast<Mask<Real>>(load(p + i) >= value); });
  }
  static unsigned sharesBits(const std::uint32_t* p, std::uint32_t value) {
    return 0xffff ^ Set::template bits<std::uint32_t>(
                        [=](int i) { return Mask<std::uint32_t>((load(p + i) & value) == 0); });
  }
  // Which of p[0..15] are below `value`; all are below 2^31.
  static unsigned below(const std::uint32_t* p, std::uint32_t value) {
    return Set::template bits<std::uint32_t>([=](int i) {
      return reinterpret_cast<Mask<std::uint32_t>>(load(p + i)) < static_cast<std::int32_t>(value);
    });
  }
  static unsigned equals(const std::uint64_t* p, std::uint64_t value) {
    return Set::template bits<std::uint64_t>(
        [=](int i) { return Mask<std::uint64_t>(load(p + i) == value); });
  }
  // Bit i: box i overlaps the box with the bounds lower(axis, i) and upper(axis, i), of which no
  // difference is NaN but for unused places. Bit 16 + i: a bound is equal to the opposite one.
  template <class BoxGroup, class Lower, class Upper>
  static std::uint32_t meetings(const BoxGroup& boxes, Lower lower, Upper upper) {
    using Floats = Register<float>;
    alignas(64) float gap[16];
    for (int i = 0; i < 16; i += Floats::lanes) {
      typename Floats::Type gaps[3];
      for (int axis = 0; axis < 3; ++axis)
        gaps[axis] = Floats::greatest(load(boxes.lower[axis] + i) - upper(axis, i),
                                      lower(axis, i) - load(boxes.upper[axis] + i));
      *reinterpret_cast<typename Floats::Type*>(gap + i) =
          Floats::greatest(Floats::greatest(gaps[0], gaps[1]), gaps[2]);
    }
    return Set::belowAndZero(gap);
  }
  // Which of p[0..15] are below zero; from bit 16 on which are zero.
  static std::uint32_t belowAndZero(const float* p) {
    const auto below = [=](int i) { return reinterpret_cast<Mask<float>>(load(p + i) < 0); };
    const auto zero = [=](int i) { return reinterpret_cast<Mask<float>>(load(p + i) == 0); };
    return Set::template bits<float>(below) | Set::template bits<float>(zero) << 16;
  }
  // Sixteen boxes to be tested against many.
  template <class Real>
  struct Sixteen {
    const Real *lower, *upper;
    std::size_t stride;

    // Which of them overlap a box, as closed intervals. Lanes are made bits once for all bounds.
    template <class BoxGroup>
    unsigned overlapping(const BoxGroup& box, unsigned lane) const {
      return Set::template bits<Real>([&](int i) {
        const auto reach = [&](int axis) {
          const std::size_t at = axis * stride + i;
          return (load(upper + at) >= box.lower[axis][lane]) &
                 (load(lower + at) <= box.upper[axis][lane]);
        };
        return reinterpret_cast<Mask<Real>>(reach(0) & reach(1) & reach(2));
      });
    }
  };
};

}  // namespace
