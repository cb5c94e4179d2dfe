// A box by centre and half lengths, as ODE keeps it, so that every library sees the very bounds
// that ODE computes from it.
#pragma once

#include <ode/ode.h>

#include <vector>

namespace bench {

struct CentredBox {
  dReal centre[3], half[3];

  dReal low(int axis) const { return centre[axis] - half[axis]; }
  dReal high(int axis) const { return centre[axis] + half[axis]; }

  // Bounds of a body that turns change their size.
  bool sameSizeAs(const CentredBox& other) const {
    return half[0] == other.half[0] && half[1] == other.half[1] && half[2] == other.half[2];
  }

  bool operator==(const CentredBox& other) const {
    return centre[0] == other.centre[0] && centre[1] == other.centre[1] &&
           centre[2] == other.centre[2] && sameSizeAs(other);
  }

  // Closed intervals, as in ODE.
  bool overlaps(const CentredBox& other) const {
    for (int axis = 0; axis < 3; ++axis)
      if (low(axis) > other.high(axis) || other.low(axis) > high(axis)) return false;
    return true;
  }
};
using Boxes = std::vector<CentredBox>;

// The extent of all boxes.
struct Extent {
  double low[3], high[3];
};
Extent extentOf(const Boxes& boxes);

}  // namespace bench
