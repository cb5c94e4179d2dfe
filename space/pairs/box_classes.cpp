#include "space/pairs/box_classes.h"

#include <algorithm>
#include <limits>

#include "space/base/mechanisms.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region surveying("box classes: survey");

// Calls visit(slot) for a sample of the boxes that are not NaN, in which no order of theirs shows:
// places are multiples of the golden ratio.
template <class Real, class Visit>
void forSample(const BoxSet& boxes, Visit visit) {
  const std::size_t count = std::min(boxes.size, sampled_boxes);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t place = static_cast<std::uint32_t>(i) * 0x9e3779b9u;
    const std::size_t slot = count == boxes.size ? i : place * boxes.size >> 32;
    if (isActive(boxesOf<Real>(boxes)[slot])) visit(static_cast<Slot>(slot));
  }
}

template <class Real>
bool isBounded(Real extent) {
  return extent <= std::numeric_limits<Real>::max();
}

}  // namespace

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
    forSample<Real>(boxes, [&](Slot slot) {
      const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
      for (int axis = 0; axis < 3; ++axis) {
        const Real extent = box.upper[axis] - box.lower[axis];
        if (!isBounded(extent)) continue;
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
int BoxClasses<Real>::numberOf(const BasicBox<Real>& box) const {
  int shape = 0;
  bool bounded = true;
  for (int axis = 0; axis < 3; ++axis) {
    const Real extent = box.upper[axis] - box.lower[axis];
    bounded = bounded && isBounded(extent);
    shape |= (extent > most_short_[axis]) << axis;
  }
  return bounded ? shape : unbounded;
}

template <class Real>
void BoxClasses<Real>::choose(const BoxSet& boxes, int threads) {
  chooseLengths(boxes);
  surveys_.resize(std::max<std::size_t>(surveys_.size(), threads));
  runTeam(surveying, threads, [&](int thread, int team) {
    std::array<ClassSummary<Real>, shapes>& summaries = surveys_[thread].summaries;
    summaries = {};
    const Range range = ownPart(boxes.size, thread, team);
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const BasicBox<Real>& box = boxesOf<Real>(boxes)[i];
      if (isActive(box)) summaries[numberOf(box)].add(box);
    }
  });
  classes_.clear();
  for (int number = 0; number < shapes; ++number) {
    ClassSummary<Real> summary = surveys_[0].summaries[number];
    for (int part = 1; part < threads; ++part) summary.add(surveys_[part].summaries[number]);
    if (summary.count) classes_.push_back({number, summary});
  }
  const auto sizeOf = [](const Class& one) {
    if (one.number == unbounded) return std::numeric_limits<double>::infinity();
    const double* const extent = one.summary.extent;
    return (extent[0] + extent[1] + extent[2]) / static_cast<double>(one.summary.count);
  };
  std::stable_sort(classes_.begin(), classes_.end(),
                   [&](const Class& a, const Class& b) { return sizeOf(a) < sizeOf(b); });
  for (std::size_t index = 0; index < classes_.size(); ++index)
    index_of_[classes_[index].number] = static_cast<std::uint8_t>(index);
}

template class BoxClasses<float>;
template class BoxClasses<double>;

}  // namespace ode_parallel_sap
