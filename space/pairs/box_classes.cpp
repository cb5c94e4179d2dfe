#include "space/pairs/box_classes.h"

#include <algorithm>
#include <limits>

#include "space/base/mechanisms.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

template <class Real>
void BoxClasses<Real>::chooseLengths(const BoxSet& boxes) {
  constexpr Real any = std::numeric_limits<Real>::max();
  std::fill(most_short_, most_short_ + 3, any);
  if (!mechanisms::box_classes) return;
  // Sums of extents and numbers of boxes on each axis, of those that are not longer than
  // most_short_, and of longer ones. No extent is less than nothing.
  double extents[3][2], counts[3][2];
  const auto sum = [&] {
    for (int axis = 0; axis < 3; ++axis) extents[axis][0] = extents[axis][1] = 0;
    for (int axis = 0; axis < 3; ++axis) counts[axis][0] = counts[axis][1] = 0;
    forSample<Real>(boxes, sampled_boxes, [&](Slot slot) {
      const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
      for (int axis = 0; axis < 3; ++axis) {
        const Real extent = box.upper[axis] - box.lower[axis];
        if (!(extent < any)) continue;  // unbounded
        const bool is_long = extent > most_short_[axis];
        extents[axis][is_long] += std::max(extent, Real(0));
        ++counts[axis][is_long];
      }
    });
  };
  sum();
  for (int axis = 0; axis < 3; ++axis)
    most_short_[axis] = static_cast<Real>(extents[axis][0] / std::max(counts[axis][0], 1.0));
  sum();
  for (int axis = 0; axis < 3; ++axis)
    if (!(extents[axis][1] * counts[axis][0] >= far_longer * extents[axis][0] * counts[axis][1]) ||
        counts[axis][1] == 0)
      most_short_[axis] = any;
}

template <class Real>
void BoxClasses<Real>::choose(const BoxSet& boxes) {
  chooseLengths(boxes);
  std::array<ClassSummary<Real>, shapes> summaries = {};
  forSample<Real>(boxes, sampled_boxes, [&](Slot slot) {
    const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
    const int number = numberOf(box);
    ClassSummary<Real>& summary = summaries[number];
    summary.number = number;
    for (int axis = 0; axis < 3; ++axis) {
      const Real centre = centreOf(box, axis);
      if (summary.count == 0 || centre < summary.low[axis]) summary.low[axis] = centre;
      summary.extent[axis] += box.upper[axis] - box.lower[axis];
    }
    ++summary.count;
  });
  classes_.clear();
  for (int number = 0; number < unbounded; ++number)
    if (summaries[number].count) classes_.push_back(summaries[number]);
  const auto sizeOf = [](const ClassSummary<Real>& one) {
    return (one.extent[0] + one.extent[1] + one.extent[2]) / static_cast<double>(one.count);
  };
  std::stable_sort(classes_.begin(), classes_.end(),
                   [&](const auto& a, const auto& b) { return sizeOf(a) < sizeOf(b); });
  index_of_.fill(static_cast<std::uint8_t>(classes_.size()));
  for (std::size_t index = 0; index < classes_.size(); ++index)
    index_of_[classes_[index].number] = static_cast<std::uint8_t>(index);
  classes_.push_back({unbounded});
}

template class BoxClasses<float>;
template class BoxClasses<double>;

}  // namespace ode_parallel_sap
