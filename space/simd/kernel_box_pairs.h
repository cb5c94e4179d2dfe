// Pairs of boxes that ODE's collider certainly finds apart. Internal linkage, as in kernels_impl.h.
#pragma once

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

// The numbers of a register of pairs: of rows of matrices, ways from centre to centre, and sides.
struct BoxRows {
  static constexpr int rows = 9;
  alignas(64) float of[rows][3][float_lanes];

  // Far from the origin, too, the difference of centres is as good as the numbers are.
  template <class Real>
  BoxRows(const BoxPairs<Real>& pairs, int first) {
    for (int lane = 0; lane < float_lanes; ++lane) {
      const int pair = first + lane;
      for (int k = 0; k < 3; ++k) {
        for (int row = 0; row < 3; ++row) {
          put(row, k, lane, pairs.matrix[0][pair][4 * row + k]);
          put(3 + row, k, lane, pairs.matrix[1][pair][4 * row + k]);
        }
        put(6, k, lane, pairs.centre[1][pair][k] - pairs.centre[0][pair][k]);
        put(7, k, lane, pairs.sides[0][pair][k]);
        put(8, k, lane, pairs.sides[1][pair][k]);
      }
    }
  }
  void take(int row, Floats* numbers) const {
    for (int k = 0; k < 3; ++k) numbers[k] = *reinterpret_cast<const Floats*>(of[row][k]);
  }

 private:
  template <class Real>
  void put(int row, int k, int lane, Real number) {
    of[row][k][lane] = static_cast<float>(number);
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
