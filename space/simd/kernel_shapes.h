// Bounds of simple shapes, and boxes of floats around these. Internal linkage, as in
// kernels_impl.h.
#pragma once

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include <string.h>

#include "space/data/box_set.h"
#include "space/data/fine_boxes.h"
#include "space/simd/kernels.h"

namespace {

using namespace ode_parallel_sap;

#if defined(__AVX2__)

// A number of each of four shapes, and three such numbers.
using Four = __m256d;
struct FourPoints {
  Four x, y, z;
};

// The two numbers at each of four addresses, in pairs: of the first and third, second and fourth.
struct FourTwos {
  Four even, odd;

  FourTwos(const double* const* at, std::size_t offset)
      : even(two(at[0] + offset, at[2] + offset)), odd(two(at[1] + offset, at[3] + offset)) {}
  Four first() const { return _mm256_unpacklo_pd(even, odd); }
  Four second() const { return _mm256_unpackhi_pd(even, odd); }

 private:
  static Four two(const double* a, const double* b) {
    return _mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(a)), _mm_loadu_pd(b), 1);
  }
};

inline Four fourAt(const double* const* at) {
  const __m128d low = _mm_loadh_pd(_mm_load_sd(at[0]), at[1]);
  const __m128d high = _mm_loadh_pd(_mm_load_sd(at[2]), at[3]);
  return _mm256_insertf128_pd(_mm256_castpd128_pd256(low), high, 1);
}
// Three numbers at each address, of which four are read.
inline FourPoints pointsAt(const double* const* at, std::size_t offset) {
  const FourTwos xy(at, offset), z(at, offset + 2);
  return {xy.first(), xy.second(), z.first()};
}

inline Four magnitudes(Four numbers) {
  return _mm256_andnot_pd(_mm256_set1_pd(-0.0), numbers);
}

// How far each shape reaches from its place. Products and sums in the order in which ODE has them.
struct SphereReach {
  static FourPoints of(const double* const*, const double* const* sizes) {
    const Four radius = fourAt(sizes);
    return {radius, radius, radius};
  }
};

struct BoxReach {
  static FourPoints of(const double* const* poses, const double* const* sizes) {
    const FourPoints sides = pointsAt(sizes, 0);
    const auto along = [&](std::size_t axis) {
      const FourPoints row = pointsAt(poses, 4 + 4 * axis);
      const Four x = magnitudes(_mm256_mul_pd(row.x, sides.x));
      const Four y = magnitudes(_mm256_mul_pd(row.y, sides.y));
      const Four z = magnitudes(_mm256_mul_pd(row.z, sides.z));
      return _mm256_mul_pd(_mm256_set1_pd(0.5), _mm256_add_pd(_mm256_add_pd(x, y), z));
    };
    return {along(0), along(1), along(2)};
  }
};

struct CapsuleReach {
  static FourPoints of(const double* const* poses, const double* const* sizes) {
    const FourTwos size(sizes, 0);
    const Four radius = size.first(), length = size.second();
    const auto along = [&](std::size_t axis) {
      const Four third = FourTwos(poses, 4 + 4 * axis + 2).first();
      const Four reach = magnitudes(_mm256_mul_pd(third, length));
      return _mm256_add_pd(_mm256_mul_pd(reach, _mm256_set1_pd(0.5)), radius);
    };
    return {along(0), along(1), along(2)};
  }
};

// Bits of a double that a float has no room for.
inline __m256i bitsBelowFloats() {
  return _mm256_set1_epi64x((1 << 29) - 1);
}

// Rounds to floats, toward zero but for numbers of one sign. Not for those beyond the range of
// floats, nor for those among their denormals.
template <bool away_if_negative>
inline __m128 rounded(Four bounds) {
  const __m256i bits = _mm256_castpd_si256(bounds), below = bitsBelowFloats();
  const __m256i negative = _mm256_cmpgt_epi64(_mm256_setzero_si256(), bits);
  const __m256i carry =
      away_if_negative ? _mm256_and_si256(negative, below) : _mm256_andnot_si256(negative, below);
  const __m256i whole = _mm256_andnot_si256(below, _mm256_add_epi64(bits, carry));
  return _mm256_cvtpd_ps(_mm256_castsi256_pd(whole));
}

// Of four shapes, a mask each.
struct FourKinds {
  static constexpr double least_reach =
      0x1p-66;  // fixed: its last bit is 2^-118, least floats 2^-126

  Four bounded;  // there are floats around the bounds that are neither denormal nor infinite
  Four far;      // the box may be coarse; stricter than isFine()

  // What reaches that far on each axis has bounds that are 0 or beyond the denormals of floats: a
  // difference of two such numbers is a multiple of the lesser one's last bit.
  FourKinds(const FourPoints& place, const FourPoints& reach) {
    const Four most = _mm256_max_pd(_mm256_max_pd(reach.x, reach.y), reach.z);
    const Four least = _mm256_min_pd(_mm256_min_pd(reach.x, reach.y), reach.z);
    const Four sum =
        _mm256_add_pd(_mm256_add_pd(magnitudes(place.x), magnitudes(place.y)), magnitudes(place.z));
    // A NaN is in the sum of all, whatever becomes of it in the others.
    const Four all = _mm256_add_pd(_mm256_add_pd(sum, reach.x), _mm256_add_pd(reach.y, reach.z));
    bounded = _mm256_and_pd(_mm256_cmp_pd(all, _mm256_set1_pd(greatest_fine_reach), _CMP_LE_OQ),
                            _mm256_cmp_pd(least, _mm256_set1_pd(least_reach), _CMP_GE_OQ));
    far = _mm256_cmp_pd(sum, _mm256_mul_pd(most, _mm256_set1_pd(most_fine_reach)), _CMP_NLE_UQ);
  }
};

inline unsigned bitsOf(Four mask) {
  return static_cast<unsigned>(_mm256_movemask_pd(mask));
}

// Which of four floats make clearly larger: as in roundOutward(), where bounds are no denormals.
__attribute__((noinline)) unsigned coarseOf(const Four* places, const Four* reaches,
                                            const __m128* lowers, const __m128* uppers) {
  Four largest = _mm256_setzero_pd(), growth = largest;
  for (int axis = 0; axis < 3; ++axis) {
    const Four lower = _mm256_sub_pd(places[axis], reaches[axis]);
    const Four upper = _mm256_add_pd(places[axis], reaches[axis]);
    const Four size = _mm256_sub_pd(upper, lower);
    const Four size_of_floats =
        _mm256_sub_pd(_mm256_cvtps_pd(uppers[axis]), _mm256_cvtps_pd(lowers[axis]));
    largest = _mm256_max_pd(largest, size);
    growth = _mm256_max_pd(growth, _mm256_sub_pd(size_of_floats, size));
  }
  const Four limit = _mm256_mul_pd(largest, _mm256_set1_pd(coarse_growth));
  return bitsOf(_mm256_cmp_pd(growth, limit, _CMP_GT_OQ));
}

// Lower and upper bounds of four shapes along an axis, side by side.
inline void storeBounds(Four lower, Four upper, std::size_t axis, double* const* bounds) {
  const Four even = _mm256_unpacklo_pd(lower, upper), odd = _mm256_unpackhi_pd(lower, upper);
  _mm_storeu_pd(bounds[0] + 2 * axis, _mm256_castpd256_pd128(even));
  _mm_storeu_pd(bounds[1] + 2 * axis, _mm256_castpd256_pd128(odd));
  _mm_storeu_pd(bounds[2] + 2 * axis, _mm256_extractf128_pd(even, 1));
  _mm_storeu_pd(bounds[3] + 2 * axis, _mm256_extractf128_pd(odd, 1));
}

inline void storeBoxes(const __m128* lower, const __m128* upper, Box* const* boxes) {
  __m128 front[4] = {lower[0], lower[1], lower[2], upper[0]};
  _MM_TRANSPOSE4_PS(front[0], front[1], front[2], front[3]);
  for (int i = 0; i < 4; ++i) _mm_storeu_ps(boxes[i]->lower, front[i]);
  const __m128 low = _mm_unpacklo_ps(upper[1], upper[2]),
               high = _mm_unpackhi_ps(upper[1], upper[2]);
  const auto back = [&](int i) { return reinterpret_cast<__m64*>(boxes[i]->upper + 1); };
  _mm_storel_pi(back(0), low);
  _mm_storeh_pi(back(1), low);
  _mm_storel_pi(back(2), high);
  _mm_storeh_pi(back(3), high);
}

// What was packed, a bit each.
struct FourPacked {
  unsigned fine, coarse;
};

// Adds all bits of the bounds to `bits`.
template <class Reach>
inline FourPacked packFourShapes(void* const* shapes, const std::uint32_t* slots,
                                 const ShapeLayout& layout, Box* boxes, __m256i& bits) {
  const double *poses[4], *sizes[4];
  double* bounds[4];
  Box* box[4];
  for (int i = 0; i < 4; ++i) {
    char* const shape = static_cast<char*>(shapes[i]);
    memcpy(poses + i, shape + layout.pose, sizeof poses[i]);  // a pointer of another type there
    sizes[i] = reinterpret_cast<const double*>(shape + layout.size);
    bounds[i] = reinterpret_cast<double*>(shape + layout.bounds);
    box[i] = boxes + slots[i];
  }
  const FourPoints place = pointsAt(poses, 0), reach = Reach::of(poses, sizes);
  const FourKinds kinds(place, reach);
  const Four places[] = {place.x, place.y, place.z}, reaches[] = {reach.x, reach.y, reach.z};
  __m128 lowers[3], uppers[3];
  for (int axis = 0; axis < 3; ++axis) {
    const Four lower = _mm256_sub_pd(places[axis], reaches[axis]);
    const Four upper = _mm256_add_pd(places[axis], reaches[axis]);
    storeBounds(lower, upper, axis, bounds);
    bits = _mm256_or_si256(bits,
                           _mm256_or_si256(_mm256_castpd_si256(lower), _mm256_castpd_si256(upper)));
    lowers[axis] = rounded<true>(lower);
    uppers[axis] = rounded<false>(upper);
  }
  storeBoxes(lowers, uppers, box);
  const unsigned fine = bitsOf(_mm256_andnot_pd(kinds.far, kinds.bounded));
  if (__builtin_expect(fine == 15, 1)) return {fine, 0};
  const unsigned far = bitsOf(_mm256_and_pd(kinds.far, kinds.bounded));
  const unsigned coarse = far ? far & coarseOf(places, reaches, lowers, uppers) : 0;
  return {fine | (far & ~coarse), coarse};
}

template <class Reach>
inline PackedShapes packAll(const ShapeList& list, const ShapeLayout& layout, Box* boxes) {
  std::uint64_t fine = 0, coarse = 0;
  __m256i bits = _mm256_setzero_si256();
  const auto pack = [&](void* const* shapes, const std::uint32_t* slots, std::size_t place) {
    const FourPacked packed = packFourShapes<Reach>(shapes, slots, layout, boxes, bits);
    fine |= std::uint64_t{packed.fine} << place;
    coarse |= std::uint64_t{packed.coarse} << place;
  };
  std::size_t i = 0;
  for (; i + 4 <= list.count; i += 4) pack(list.first + i, list.slots + i, i);
  if (i < list.count) {
    void* shapes[4];
    std::uint32_t slots[4];
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t from = i + k < list.count ? i + k : i;  // some more than once
      shapes[k] = list.first[from];
      slots[k] = list.slots[from];
    }
    pack(shapes, slots, i);
  }
  const std::uint64_t all = ~std::uint64_t{0} >> (64 - list.count);
  return {fine & all, coarse & all, _mm256_testz_si256(bits, bitsBelowFloats()) != 0};
}

PackedShapes packShapes(ShapeKind shape, const ShapeList& shapes, const ShapeLayout& layout,
                        Box* boxes) {
  switch (shape) {
    case ShapeKind::sphere:
      return packAll<SphereReach>(shapes, layout, boxes);
    case ShapeKind::box:
      return packAll<BoxReach>(shapes, layout, boxes);
    default:
      return packAll<CapsuleReach>(shapes, layout, boxes);
  }
}

constexpr PackShapes pack_shapes = packShapes;

#else

constexpr PackShapes pack_shapes = nullptr;

#endif

}  // namespace
