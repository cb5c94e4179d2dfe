// Pairs of boxes that ODE's collider certainly finds apart. Internal linkage, as in kernels_impl.h.
#pragma once

#include <string.h>

#include "space/simd/kernels.h"

namespace {

using namespace ode_parallel_sap;

// dBoxBox (ODE 0.16) returns no contact as soon as a number that it computes for one of fifteen
// axes is above 0: |d| - r, d the distance of the centres and r the reach of both boxes along it.
// These are the same numbers, whatever the matrices are, so it comes to the same once one of them
// is above all errors of both computations.
//
// Let e be the epsilon of floats, which bounds the error of an operation in any rounding mode, and
// size = |between|_1 + all half sides. A sum of squares of at most 4 bounds the length of a
// matrix's columns by 2, and so the products of two of them by 4. Errors, each with the next one's:
// of a rounded input e, of a centre's coordinate along an axis 10 e size, of a product of two axes
// 20 e, of the number of an axis of a face 44 e size, of an axis across two edges 256 e size. Twice
// that for both computations, and twice that again for the rounding of the bound itself.
constexpr float box_pair_rounding = 1024 * __FLT_EPSILON__;
constexpr float most_squares = 4;  // fixed: of what is a rotation, with room
// fixed: of these sizes no product overflows, and what underflows is below e size by a factor of
// 2^20.
constexpr float least_box_pair_size = 0x1p-80f, most_box_pair_size = 0x1p100f;

constexpr int float_lanes = Register<float>::lanes;
using Floats = Register<float>::Type;
using Words = int __attribute__((vector_size(register_bytes)));

inline Floats magnitudeOf(Floats x) {
  return reinterpret_cast<Floats>(reinterpret_cast<Words>(x) & 0x7fffffff);
}
inline Floats dot(const Floats* x, const Floats* y) {
  return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}
inline Floats sumOf(const Floats* x) {
  return magnitudeOf(x[0]) + magnitudeOf(x[1]) + magnitudeOf(x[2]);
}

// Rows of three numbers, each of a pair and lying side by side, become the numbers of many pairs.
constexpr int rows_of_pair = 9;  // fixed: matrices, from centre to centre, sides
struct alignas(64) BoxRows {
  // Of pairs 4 b + i of a register, at [i][4 b]; the fourth number is nothing.
  float of[rows_of_pair][4][float_lanes];

  template <class Real>
  BoxRows(const BoxPairs<Real>& pairs, int first) {
    for (int lane = 0; lane < float_lanes; ++lane) {
      const int pair = first + lane;
      for (int row = 0; row < 3; ++row) {
        put(lane, row, pairs.matrix[0][pair] + 4 * row);
        put(lane, 3 + row, pairs.matrix[1][pair] + 4 * row);
      }
      putDifference(lane, 6, pairs.centre[0][pair], pairs.centre[1][pair]);
      put(lane, 7, pairs.sides[0][pair]);
      put(lane, 8, pairs.sides[1][pair]);
    }
  }

  void take(int row, Floats* numbers) const {
    const auto at = [&](int i) { return *reinterpret_cast<const Floats*>(of[row][i]); };
    Floats low[2], high[2];
    for (int i = 0; i < 2; ++i) {
      pick<0, 4, 1, 5>(at(2 * i), at(2 * i + 1), &low[i]);
      pick<2, 6, 3, 7>(at(2 * i), at(2 * i + 1), &high[i]);
    }
    pick<0, 1, 4, 5>(low[0], low[1], numbers);
    pick<2, 3, 6, 7>(low[0], low[1], numbers + 1);
    pick<0, 1, 4, 5>(high[0], high[1], numbers + 2);
  }

 private:
  using FourFloats = FourOf<float>::Type;

  void place(const FourFloats& numbers, int lane, int row) {
    memcpy(of[row][lane % 4] + lane / 4 * 4, &numbers, sizeof numbers);
  }
  template <class Real>
  void put(int lane, int row, const Real* from) {
    typename FourOf<Real>::Type numbers;
    memcpy(&numbers, from, sizeof numbers);
    place(__builtin_convertvector(numbers, FourFloats), lane, row);
  }
  // Far from the origin, too, the difference is as good as the numbers are.
  template <class Real>
  void putDifference(int lane, int row, const Real* from, const Real* to) {
    typename FourOf<Real>::Type a, b;
    memcpy(&a, from, sizeof a);
    memcpy(&b, to, sizeof b);
    b -= a;
    place(__builtin_convertvector(b, FourFloats), lane, row);
  }
};

// A register of pairs.
struct BoxPairLanes {
  Floats p[3], q[3], a[3], b[3];    // from centre to centre in space and along r1; half sides
  Floats r1[3][3], r2[3][3];        // by coordinate and axis
  Floats product[3][3], abs[3][3];  // of an axis of the first and one of the second box

  explicit BoxPairLanes(const BoxRows& rows) {
    for (int k = 0; k < 3; ++k) {
      rows.take(k, r1[k]);
      rows.take(3 + k, r2[k]);
    }
    rows.take(6, p);
    rows.take(7, a);
    rows.take(8, b);
    for (int i = 0; i < 3; ++i) {
      a[i] *= 0.5f;
      b[i] *= 0.5f;
      q[i] = r1[0][i] * p[0] + r1[1][i] * p[1] + r1[2][i] * p[2];
      for (int j = 0; j < 3; ++j) {
        product[i][j] = r1[0][i] * r2[0][j] + r1[1][i] * r2[1][j] + r1[2][i] * r2[2][j];
        abs[i][j] = magnitudeOf(product[i][j]);
      }
    }
  }

  // The numbers of the axes of the boxes.
  Floats ofFirst(int i) const {
    return magnitudeOf(q[i]) - (a[i] + b[0] * abs[i][0] + b[1] * abs[i][1] + b[2] * abs[i][2]);
  }
  Floats ofSecond(int j) const {
    return magnitudeOf(r2[0][j] * p[0] + r2[1][j] * p[1] + r2[2][j] * p[2]) -
           (a[0] * abs[0][j] + a[1] * abs[1][j] + a[2] * abs[2][j] + b[j]);
  }
  // Of that across axis i of the first and j of the second box.
  Floats ofEdges(int i, int j) const {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    return magnitudeOf(q[i2] * product[i1][j] - q[i1] * product[i2][j]) -
           (a[i1] * abs[i2][j] + a[i2] * abs[i1][j] + b[j1] * abs[i][j2] + b[j2] * abs[i][j1]);
  }
  // NaN is neither above nor below anything.
  Floats greatest() const {
    Floats found = ofFirst(0);
    for (int i = 1; i < 3; ++i) found = Register<float>::greatest(ofFirst(i), found);
    for (int j = 0; j < 3; ++j) found = Register<float>::greatest(ofSecond(j), found);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) found = Register<float>::greatest(ofEdges(i, j), found);
    return found;
  }
  // All ones where the bound on errors holds: not where anything is NaN.
  Words areBounded(Floats size) const {
    const Floats squares1 = dot(r1[0], r1[0]) + dot(r1[1], r1[1]) + dot(r1[2], r1[2]);
    const Floats squares2 = dot(r2[0], r2[0]) + dot(r2[1], r2[1]) + dot(r2[2], r2[2]);
    return (squares1 <= most_squares) & (squares2 <= most_squares) & (size >= least_box_pair_size) &
           (size <= most_box_pair_size);
  }
  // 1 where the pair is certainly apart, 0 elsewhere.
  Floats areApart() const {
    const Floats size = sumOf(p) + sumOf(a) + sumOf(b);
    const Words apart = (greatest() > box_pair_rounding * size) & areBounded(size);
    return apart ? Floats{} + 1.0f : Floats{};
  }
};

template <class Real>
unsigned boxesApart(const BoxPairs<Real>& pairs) {
  alignas(64) float apart[group_size];
  for (int first = 0; first < group_size; first += float_lanes)
    *reinterpret_cast<Floats*>(apart + first) = BoxPairLanes(BoxRows(pairs, first)).areApart();
  return Lanes::atLeast(apart, 1.0f);
}

}  // namespace
