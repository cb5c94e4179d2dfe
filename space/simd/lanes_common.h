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

// Four numbers of a type.
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

// For sets whose comparisons fill the lanes of a register, of which Set::signs() makes bits.
template <class Set>
struct RegisterLanes {
  // Writes the elements of p[0..15] in `mask`, in order. Writes at most 16; how many count is the
  // number of bits. `out` may be p, or any place before it.
  template <class T>
  static void compress(const T* p, unsigned mask, T* out) {
    for (; mask; mask &= mask - 1) *out++ = p[__builtin_ctz(mask)];
  }
  // Writes `first` + i for each bit i of `mask`, in order. Writes at most 16 numbers.
  static void writeNumbers(std::uint32_t first, unsigned mask, std::uint32_t* out) {
    for (; mask; mask &= mask - 1) *out++ = first + static_cast<std::uint32_t>(__builtin_ctz(mask));
  }
  // The least and the greatest of sixteen, NaN apart; NaN where all are.
  template <class Real>
  static Real least(const Real* p) {
    return joined(p, [](auto& all, const auto& other) {
      all = ((all < other) | (other != other)) ? all : other;
    });
  }
  template <class Real>
  static Real greatest(const Real* p) {
    return joined(p, [](auto& all, const auto& other) {
      all = ((all > other) | (other != other)) ? all : other;
    });
  }
  // Of a comparison: all bits of a lane, or none.
  template <class T>
  using Mask =
      typename Register<std::conditional_t<sizeof(T) == 8, std::int64_t, std::int32_t>>::Type;

  template <class T>
  static typename Register<T>::Type load(const T* p) {
    return *reinterpret_cast<const typename Register<T>::Type*>(p);
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
  // Writes the value `count` times; eight or sixteen words are written.
  static void fill(std::uint32_t value, int count, std::uint32_t* to) {
    typedef std::uint32_t Words __attribute__((vector_size(register_bytes < 32 ? 16 : 32)));
    const Words words = Words{} + value;
    constexpr int lanes = sizeof words / sizeof value;
    for (int i = 0; i < 8; i += lanes) memcpy(to + i, &words, sizeof words);
    if (__builtin_expect(count > 8, false))
      for (int i = 8; i < 16; i += lanes) memcpy(to + i, &words, sizeof words);
  }
  static unsigned equals(const std::uint64_t* p, std::uint64_t value) {
    return Set::template bits<std::uint64_t>(
        [=](int i) { return Mask<std::uint64_t>(load(p + i) == value); });
  }
  // See kernel_cells.h. No difference of bounds is NaN, but for unused places.
  template <class BoxGroup, class Allowed>
  static int meetBoxes(const BoxGroup& own, unsigned lane, const BoxGroup& boxes, Allowed allowed,
                       std::uint32_t* row) {
    using Floats = Register<float>;
    using Slots = typename Register<std::uint32_t>::Type;  // unused places may hold anything
    alignas(64) std::uint32_t words[16];
    const unsigned hits = allowed(Set::template bits<float>([&](int i) {
      typename Floats::Type gaps[3];
      for (int axis = 0; axis < 3; ++axis)
        gaps[axis] = Floats::greatest(load(boxes.lower[axis] + i) - own.upper[axis][lane],
                                      own.lower[axis][lane] - load(boxes.upper[axis] + i));
      const typename Floats::Type gap =
          Floats::greatest(Floats::greatest(gaps[0], gaps[1]), gaps[2]);
      const Slots slots = load(boxes.slot + i);
      *reinterpret_cast<Slots*>(words + i) = slots + slots - reinterpret_cast<Slots>(gap == 0);
      return reinterpret_cast<Mask<float>>(gap <= 0);
    }));
    Set::compress(words, hits, row);
    return __builtin_popcount(hits);
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

 private:
  template <class Real, class Join>
  static Real joined(const Real* p, Join join) {
    typename FourOf<Real>::Type all, other;
    memcpy(&all, p, sizeof all);
    for (int i = 4; i < 16; i += 4) {
      memcpy(&other, p + i, sizeof other);
      join(all, other);
    }
    pick<2, 3, 0, 1>(all, all, &other);
    join(all, other);
    pick<1, 0, 3, 2>(all, all, &other);
    join(all, other);
    return all[0];
  }
};

}  // namespace
