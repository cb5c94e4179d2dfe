#include "space/pairs/quantizer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "space/base/curve_digits.h"

namespace ode_parallel_sap {

template <class Real>
void ClassSummary<Real>::add(const BasicBox<Real>& box) {
  for (int axis = 0; axis < 3; ++axis) {
    const Real centre = centreOf(box, axis);
    low[axis] = std::min(low[axis], centre);
    high[axis] = std::max(high[axis], centre);
    extent[axis] += box.upper[axis] - box.lower[axis];
  }
  ++count;
}

template <class Real>
void ClassSummary<Real>::add(const ClassSummary<Real>& other) {
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = std::min(low[axis], other.low[axis]);
    high[axis] = std::max(high[axis], other.high[axis]);
    extent[axis] += other.extent[axis];
  }
  count += other.count;
}

template <class Real>
Quantizer<Real>::Quantizer(const ClassSummary<Real>& summary, int digits) : digits_(digits) {
  double step[3];  // length of a step in mean extents
  double greatest_extent = 0;
  for (double extent : summary.extent)
    if (std::isfinite(extent)) greatest_extent = std::max(greatest_extent, extent);
  for (int axis = 0; axis < 3; ++axis) {
    const double range = static_cast<double>(summary.high[axis]) - summary.low[axis];
    const double extent = extentToMeasureBy(summary.extent[axis], greatest_extent);
    step[axis] = std::isfinite(range) && std::isfinite(extent) && range > 0 ? range / extent : 0;
  }
  CurveDigits curve;
  curve.deal(step, digits);
  for (int axis = 0; axis < 3; ++axis) {
    const double range = static_cast<double>(summary.high[axis]) - summary.low[axis];
    const double steps = std::ldexp(1.0, curve.bits[axis]);
    origin_[axis] = summary.low[axis];
    // A range too small to divide by is left as one step.
    const double scale = range > 0 ? steps / range : 0;
    scale_[axis] = scale < std::numeric_limits<Real>::max() ? static_cast<Real>(scale) : 0;
    last_step_[axis] = static_cast<Real>(steps - 1);

    std::uint32_t digit_of_bit[max_bits];
    for (int digit = 0, bit = 0; digit < digits; ++digit)
      if (curve.axisOf(digit) == axis) digit_of_bit[bit++] = std::uint32_t{1} << digit;
    for (int byte = 0; byte < 3; ++byte) {
      const int first_bit = 8 * byte;
      const int count = std::max(0, std::min(8, curve.bits[axis] - first_bit));
      spread_[axis][byte][0] = 0;
      for (int bit = 0; bit < count; ++bit)
        for (int value = 0; value < 1 << bit; ++value)
          spread_[axis][byte][value | 1 << bit] =
              spread_[axis][byte][value] | digit_of_bit[first_bit + bit];
    }
  }
}

template struct ClassSummary<float>;
template struct ClassSummary<double>;
template class Quantizer<float>;
template class Quantizer<double>;

}  // namespace ode_parallel_sap
