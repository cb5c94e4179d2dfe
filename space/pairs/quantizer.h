// Keys along a space-filling (Z) curve through a box of centres.
#pragma once

#include <cstdint>
#include <limits>

#include "space/base/box_set.h"

namespace ode_parallel_sap {

// Centre range and mean extents of a number of boxes.
template <class Real>
struct ClassSummary {
  static constexpr Real infinity = std::numeric_limits<Real>::infinity();
  Real low[3] = {infinity, infinity, infinity};  // of the centres
  Real high[3] = {-infinity, -infinity, -infinity};
  double extent[3] = {};  // sums
  std::size_t count = 0;

  void add(const BasicBox<Real>& box);
  void add(const ClassSummary& other);
};

// Half sums, scaled so that they cannot overflow. Infinite on both sides: 0, so that all compare.
template <class Real>
inline Real centreOf(const BasicBox<Real>& box, int axis) {
  const Real centre = Real(0.5) * box.lower[axis] + Real(0.5) * box.upper[axis];
  return centre == centre ? centre : 0;
}

// Gives each of the binary digits of a key to one axis (CurveDigits).
template <class Real>
class Quantizer {
 public:
  static constexpr int max_bits = 24;  // fixed: three tables of eight digits

  Quantizer(const ClassSummary<Real>& summary, int digits);

  std::uint32_t keyOf(const BasicBox<Real>& box) const {
    std::uint32_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t step = stepOf(centreOf(box, axis), axis);
      key |= spread_[axis][0][step & 0xff] | spread_[axis][1][step >> 8 & 0xff] |
             spread_[axis][2][step >> 16];
    }
    return key;
  }
  // Keys are below 2^digits().
  int digits() const { return digits_; }

 private:
  std::uint32_t stepOf(Real centre, int axis) const {
    const Real step = (centre - origin_[axis]) * scale_[axis];
    // A comparison that is false for NaN, which inverted boxes around infinity could give.
    return step > 0 ? step < last_step_[axis] ? static_cast<std::uint32_t>(step)
                                              : static_cast<std::uint32_t>(last_step_[axis])
                    : 0;
  }

  Real origin_[3], scale_[3], last_step_[3];
  int digits_;
  std::uint32_t spread_[3][3][256];  // axis, byte of the step, value: its digits in the key
};

}  // namespace ode_parallel_sap
