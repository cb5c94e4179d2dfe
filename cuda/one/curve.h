// Keys along a space-filling (Z) curve through a range of centres. For kernels and host.
#pragma once

#include "cuda/one/elements.h"
#include "space/data/curve_digits.h"

namespace ode_parallel_sap {
namespace device {

// How the centres of one class become keys (Quantizer on the CPU).
struct Curve : CurveDigits {
  float origin[3], prescale[3], scale[3], last_step[3];

  // From the centres' range, as ordered integers, and the sums of the boxes' extents.
  ODE_PARALLEL_SAP_BOTH_SIDES void choose(const int* low, const int* high,
                                          const unsigned long long* extent, int digits) {
    double range[3], step[3], greatest = 0;
    for (int axis = 0; axis < 3; ++axis)
      greatest = fmax(greatest, static_cast<double>(extent[axis]));
    for (int axis = 0; axis < 3; ++axis) {
      const bool any = low[axis] <= high[axis];
      origin[axis] = any ? unordered(low[axis]) : 0;
      range[axis] = any ? static_cast<double>(unordered(high[axis])) - origin[axis] : 0;
      step[axis] = range[axis] / extentToMeasureBy(static_cast<double>(extent[axis]), greatest);
    }
    deal(step, digits);
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = static_cast<double>(1u << bits[axis]);
      // In two factors: ranges near the denormals need one beyond the floats.
      prescale[axis] = range[axis] < 1e-30 ? 0x1p100f : 1.0f;
      const double factor = range[axis] > 0 ? steps / (range[axis] * prescale[axis]) : 0;
      scale[axis] = static_cast<float>(factor);
      last_step[axis] = static_cast<float>(steps * (1 - 1.0 / (1 << 24)));  // the greatest below
    }
  }
  // Comparisons that are false for NaN, which inverted boxes around infinity could give.
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t stepOf(float low, float high, int axis) const {
    const float step = (centreOf(low, high) - origin[axis]) * prescale[axis] * scale[axis];
    return step > 0 ? static_cast<std::uint32_t>(step < last_step[axis] ? step : last_step[axis])
                    : 0;
  }
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t keyOf(const Record& box, int digits) const {
    std::uint32_t x = stepOf(box.low.x, box.high.x, 0), y = stepOf(box.low.y, box.high.y, 1),
                  z = stepOf(box.low.z, box.high.z, 2);
    std::uint32_t key = 0;
    unsigned long long left = axes;
    for (int digit = 0; digit < digits; ++digit, left >>= 2) {
      const unsigned axis = left & 3;
      const std::uint32_t bit = axis == 0 ? x & 1 : axis == 1 ? y & 1 : z & 1;
      key |= bit << digit;
      x >>= axis == 0;
      y >>= axis == 1;
      z >>= axis == 2;
    }
    return key;
  }
};

}  // namespace device
}  // namespace ode_parallel_sap
