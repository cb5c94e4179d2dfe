// Keys along a space-filling (Z) curve through a range of centres. For kernels and host.
#pragma once

#include "cuda/one/elements.h"
#include "space/base/both_sides.h"

namespace ode_parallel_sap {
namespace device {

// Puts the lowest digits of a number where those of a mask are, in their order. In five steps: each
// moves digits up by half as many places as the one before, those that have so far to go (H. S.
// Warren, Hacker's Delight, "Expand, or Generalized Insert").
struct DigitSpread {
  std::uint32_t mask, moved[5];  // where those come to lie that a step of 2^i moves

  ODE_PARALLEL_SAP_BOTH_SIDES void choose(std::uint32_t digits) {
    mask = digits;
    // Backwards: digits that have an odd number of gaps below go one down, and then two, four ...
    std::uint32_t gaps = ~digits << 1;
    for (int step = 0; step < 5; ++step) {
      std::uint32_t odd = gaps;
      for (int way = 1; way < 32; way *= 2) odd ^= odd << way;
      moved[step] = odd & digits;
      digits = (digits ^ moved[step]) | moved[step] >> (1 << step);
      gaps &= ~odd;
    }
  }
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t of(std::uint32_t number) const {
    for (int step = 4; step >= 0; --step)
      number = (number & ~moved[step]) | (number << (1 << step) & moved[step]);
    return number & mask;
  }
};

// How the centres of one class become keys: which axis each digit belongs to. A flat or long scene
// spends its digits where it has room, and cells come out in the shape of the boxes.
struct Curve {
  unsigned long long axes;  // two bits a digit, the lowest digit's lowest
  int bits[3];              // digits of each axis
  float origin[3], prescale[3], scale[3], last_step[3];
  DigitSpread spread[3];

  ODE_PARALLEL_SAP_BOTH_SIDES int axisOf(int digit) const {
    return static_cast<int>(axes >> 2 * digit & 3);
  }
  // Always to the axis on which the steps are still the longest; `step` are their lengths, in terms
  // of the boxes' mean extents there, before there is any digit. Up to 32 digits.
  ODE_PARALLEL_SAP_BOTH_SIDES void deal(double (&step)[3], int digits) {
    axes = 0;
    bits[0] = bits[1] = bits[2] = 0;
    for (int digit = digits - 1; digit >= 0; --digit) {
      const int axis = step[0] >= step[1] ? step[0] >= step[2] ? 0 : 2 : step[1] >= step[2] ? 1 : 2;
      axes |= static_cast<unsigned long long>(axis) << 2 * digit;
      step[axis] *= 0.5;
      ++bits[axis];
    }
  }
  // From the centres' range, as ordered integers, and the sums of the boxes' extents. All but how
  // digits are spread.
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
  // The rest, axis by axis, so that threads can share it.
  ODE_PARALLEL_SAP_BOTH_SIDES void chooseSpread(int axis, int digits) {
    std::uint32_t own = 0;
    for (int digit = 0; digit < digits; ++digit)
      if (axisOf(digit) == axis) own |= 1u << digit;
    spread[axis].choose(own);
  }
  // Comparisons that are false for NaN, which inverted boxes around infinity could give.
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t stepOf(float low, float high, int axis) const {
    const float step = (centreOf(low, high) - origin[axis]) * prescale[axis] * scale[axis];
    return step > 0 ? static_cast<std::uint32_t>(step < last_step[axis] ? step : last_step[axis])
                    : 0;
  }
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t keyOf(const Record& box) const {
    return spread[0].of(stepOf(box.low.x, box.high.x, 0)) |
           spread[1].of(stepOf(box.low.y, box.high.y, 1)) |
           spread[2].of(stepOf(box.low.z, box.high.z, 2));
  }
};

}  // namespace device
}  // namespace ode_parallel_sap
