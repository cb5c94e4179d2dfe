// Boxes divided by size and shape, so that a large or long box does not blow up the cells of
// others.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"

namespace ode_parallel_sap {

// What a sample has of a class: extents and least centres.
template <class Real>
struct ClassSummary {
  int number = 0;  // of the class, before classes are in order
  Real low[3] = {};
  double extent[3] = {};  // sums
  std::size_t count = 0;  // of boxes
};

// Half sums, scaled so that they cannot overflow. Doubles that are infinite on both sides: 0, so
// that all compare.
template <class Real>
inline Real centreOf(const BasicBox<Real>& box, int axis) {
  const Real centre = Real(0.5) * box.lower[axis] + Real(0.5) * box.upper[axis];
  return sizeof(Real) == sizeof(float) || centre == centre ? centre : 0;
}

// Calls visit(slot) for `most` of the boxes, or all, that are not NaN: a sample in which no order
// of theirs shows, as places are multiples of the golden ratio.
template <class Real, class Visit>
void forSample(const BoxSet& boxes, std::size_t most, Visit visit) {
  const std::size_t count = std::min(boxes.size, most);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t place = static_cast<std::uint32_t>(i) * 0x9e3779b9u;
    const std::size_t slot = count == boxes.size ? i : place * boxes.size >> 32;
    if (isActive(boxesOf<Real>(boxes)[slot])) visit(static_cast<Slot>(slot));
  }
}

// A box is long on an axis if it is longer than the mean there, where those are far longer than the
// others. A sample of the boxes decides that: any division leads to the same pairs.
template <class Real>
class BoxClasses {
 public:
  // Chooses the classes for the boxes that are not NaN.
  void choose(const BoxSet& boxes);

  // Those that the sample shows, small boxes first, and a last one for all others: boxes with
  // infinite extents, or ones beyond the type, and shapes that are too few to be seen.
  std::size_t count() const { return classes_.size(); }
  const ClassSummary<Real>& summary(std::size_t index) const { return classes_[index]; }
  // The class of a box that is not NaN.
  std::size_t of(const BasicBox<Real>& box) const { return index_of_[numberOf(box)]; }
  std::size_t bytes() const { return bytesOf(classes_); }

 private:
  static constexpr int unbounded = 8, shapes = 9;  // fixed: long or not on three axes; unbounded

  void chooseLengths(const BoxSet& boxes);
  int numberOf(const BasicBox<Real>& box) const {
    constexpr Real most = std::numeric_limits<Real>::max();
    int shape = 0;
    bool bounded = true;
    for (int axis = 0; axis < 3; ++axis) {
      const Real extent = box.upper[axis] - box.lower[axis];
      bounded &= extent < most;
      shape |= (extent > most_short_[axis]) << axis;
    }
    return bounded ? shape : unbounded;
  }

  Real most_short_[3];  // the greatest extents of boxes that are not long
  std::vector<ClassSummary<Real>> classes_;
  std::array<std::uint8_t, shapes> index_of_;
};

}  // namespace ode_parallel_sap
