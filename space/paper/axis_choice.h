// In which order the axes are asked for a pair.
#pragma once

#include <cstdint>
#include <utility>

namespace ode_parallel_sap {

// The pairs of the fullest axis are looked up in the emptiest, so that few are left for the third.
struct AxisChoice {
  int fullest, second, third;
};

// From the number of pairs that overlap on each axis.
inline AxisChoice chooseAxes(const std::uint64_t (&pairs)[3]) {
  AxisChoice axes = {0, 1, 2};
  if (pairs[axes.second] > pairs[axes.fullest]) std::swap(axes.second, axes.fullest);
  if (pairs[axes.third] > pairs[axes.fullest]) std::swap(axes.third, axes.fullest);
  if (pairs[axes.third] < pairs[axes.second]) std::swap(axes.third, axes.second);
  return axes;
}

}  // namespace ode_parallel_sap
