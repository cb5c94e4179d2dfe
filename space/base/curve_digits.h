// Which axis each digit of a key along a space-filling (Z) curve belongs to: a device's Curve; and
// what centres are measured by, also on the CPU.
#pragma once

#include "space/base/both_sides.h"

namespace ode_parallel_sap {

// A flat or long scene spends its digits where it has room, and cells come out in the shape of the
// boxes.
struct CurveDigits {
  unsigned long long axes;  // two bits a digit, the lowest digit's lowest
  int bits[3];              // digits of each axis

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
};

// What ranges of centres are measured by: the boxes' extents on the axis. Extents of nothing are
// taken as a small part of the greatest, or as all the same.
ODE_PARALLEL_SAP_BOTH_SIDES inline double extentToMeasureBy(double extent, double greatest) {
  constexpr double thinnest = 1.0 / 1024;  // fixed: any small part
  if (!(greatest > 0)) return 1;
  return extent < greatest * thinnest ? greatest * thinnest : extent;
}

}  // namespace ode_parallel_sap
