// The boxes cut into cells: sixteen that are near each other and of like size.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// What a sample has of a class: extents and least centres.
template <class Real>
struct ClassSummary {
  int number = 0;  // of the class, before classes are in order
  Real low[3] = {};
  double extent[3] = {};  // sums
  std::size_t count = 0;  // of boxes
};

// Half sums, which cannot overflow. Doubles that are infinite on both sides: 0, which compares.
template <class Real>
inline Real centreOf(const BasicBox<Real>& box, int axis) {
  const Real centre = Real(0.5) * box.lower[axis] + Real(0.5) * box.upper[axis];
  return sizeof(Real) == sizeof(float) || centre == centre ? centre : 0;
}

// Calls visit(slot) for `most` of the boxes, or all, that are not NaN: a sample in which no order
// of theirs shows, as places are multiples of the golden ratio.
template <class Real, class Visit>
void forSample(const BoxSet& boxes, std::size_t most, Visit visit) {
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  const std::size_t count = std::min(boxes.size, most);
  const auto slotOf = [&](std::size_t i) -> std::size_t {
    const std::uint64_t place = static_cast<std::uint32_t>(i) * 0x9e3779b9u;
    return count == boxes.size ? i : place * boxes.size >> 32;
  };
  for (std::size_t i = 0; i < count; ++i) {
    prefetch(&box[slotOf(std::min(i + prefetch_distance, count - 1))]);
    const std::size_t slot = slotOf(i);
    if (isActive(box[slot])) visit(static_cast<Slot>(slot));
  }
}

// A box is long on an axis if it is longer than the mean there, where those are far longer than the
// others, and than a cell of all boxes would be: among shorter ones cells hardly grow. A sample of
// the boxes decides that: any division leads to the same pairs.
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

  double cellLength(const BoxSet& boxes) const;
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

// Boxes are divided into classes (BoxClasses), and a large class into regions by the halves of a
// sample. Each region is halved along the axis on which its centres lie farthest apart, in terms of
// the boxes' extents, until sixteen boxes are left. All cells but the last one of a region are
// full, whatever the distribution, and no length has to be chosen by anyone.
//
// The cells are a means only: they decide how long finding the pairs takes, never which are found.
template <class Real>
class CellOrder {
 public:
  // Orders all boxes that are not NaN. What `workspace` holds is lost, and then of no use.
  void build(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace);

  CellBoxes boxesOfCells() const { return {order_.data(), starts_.data()}; }
  // For each class the last of its cells, plus one. Small boxes come first, unbounded ones last.
  const std::vector<std::uint32_t>& classEnds() const { return class_ends_; }
  std::size_t bytes() const {
    return bytesOf(box_classes_, splits_, positions_, rooms_, order_, starts_);
  }

 private:
  // A class's regions, numbered through all classes.
  struct Regions {
    std::uint32_t root;          // its first split
    std::uint32_t first, count;  // a power of two
    Real origin[3], scale[3];    // centres are counted from there, in mean extents
  };
  // The first ones stand for the regions, by number, and lead to themselves.
  struct Split {
    float at;                  // of the upper half's least centre, or NaN
    std::uint32_t below_axis;  // the split of the lower half, and the axis; the next is the upper's
  };
  static constexpr int axis_bits = 2;  // fixed: of three axes
  static constexpr std::uint32_t axis_mask = (1u << axis_bits) - 1;
  // Centres of a class that a split divides. Below split i, counted from 1, are 2 i and 2 i + 1.
  struct SamplePart {
    std::uint32_t box_class, split;
    Centre *begin, *end;
  };

  Centre centreIn(const Regions& regions, const BasicBox<Real>& box, Slot slot) const;
  void layRegions(const BoxSet& boxes, int threads);
  Centre* splitSample(const SamplePart& part);
  void splitSamples(std::vector<std::vector<Centre>>& samples, int threads);
  void dealIntoRegions(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace);
  void halveRegions(int threads);

  BoxClasses<Real> box_classes_;
  std::vector<Regions> regions_;  // one a class, and one of boxes that are NaN
  std::vector<Split> splits_;
  std::uint32_t region_count_ = 0, most_regions_of_class_ = 0;
  Buffer<std::uint32_t> positions_;                // of the regions, for each thread
  std::vector<std::uint32_t> ends_, first_cells_;  // of the regions
  std::vector<std::uint32_t> class_ends_;          // in cells
  Centre* centres_ = nullptr;
  std::vector<Buffer<float>> rooms_;  // to cut regions in; one a thread
  Buffer<std::uint32_t> order_;       // until the boxes are dealt into regions: these, by slot
  Buffer<std::uint32_t> starts_;
};

}  // namespace ode_parallel_sap
