// Keys along a space-filling (Z) curve through a range of centres. For kernels and host.
#ifndef ODE_PARALLEL_SAP_CUDA_CURVE_H
#define ODE_PARALLEL_SAP_CUDA_CURVE_H

#include "cuda/one/elements.h"

namespace ode_parallel_sap {
namespace device {

// How the centres of one class become keys: each digit goes to the axis on which the steps are
// still the longest in terms of the boxes' mean extent there (Quantizer on the CPU).
struct Curve {
  float origin[3], stretch[3], scale[3], last_step[3];
  unsigned long long axes;  // two bits a digit, the lowest digit's lowest
  int bits[3];

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
      // Extents of nothing are taken as a small part of the largest, or as all the same.
      step[axis] = range[axis] /
                   (greatest > 0 ? fmax(static_cast<double>(extent[axis]), greatest / 1024) : 1.0);
      bits[axis] = 0;
    }
    axes = 0;
    for (int digit = digits - 1; digit >= 0; --digit) {
      const int axis = step[0] >= step[1] ? step[0] >= step[2] ? 0 : 2 : step[1] >= step[2] ? 1 : 2;
      axes |= static_cast<unsigned long long>(axis) << 2 * digit;
      step[axis] *= 0.5;
      ++bits[axis];
    }
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = static_cast<double>(1u << bits[axis]);
      // In two factors: ranges near the denormals need one beyond the floats.
      stretch[axis] = range[axis] < 1e-30 ? 0x1p100f : 1.0f;
      const double factor = range[axis] > 0 ? steps / (range[axis] * stretch[axis]) : 0;
      scale[axis] = static_cast<float>(factor);
      last_step[axis] = static_cast<float>(steps * (1 - 1.0 / (1 << 24)));  // the greatest below
    }
  }
  // Comparisons that are false for NaN, which inverted boxes around infinity could give.
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t stepOf(float low, float high, int axis) const {
    const float step = (centreOf(low, high) - origin[axis]) * stretch[axis] * scale[axis];
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

#endif
