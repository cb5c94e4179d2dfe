// The boxes cut into cells: sixteen that are near each other and of like size.
#pragma once

#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/pairs/box_classes.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// Boxes are divided into classes (BoxClasses), and a large class into regions by the halves of a
// sample. Each region is halved along the axis on which its centres lie farthest apart, in terms of
// the boxes' extents, until sixteen boxes are left. All cells but the last one of a region are
// full, whatever the distribution, and no length has to be chosen by anyone.
//
// The cells are a means only: they decide how long finding the pairs takes, never which are found.
template <class Real>
class CellOrder {
 public:
  // Orders all boxes of `boxes` that are not NaN. What `workspace` holds is lost; it is of no use
  // here afterwards.
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
    int axis;
    float at;             // of the upper half's least centre, or NaN
    std::uint32_t below;  // the split of the lower half; the next one is the upper half's
  };

  Centre centreIn(const Regions& regions, const BasicBox<Real>& box, Slot slot) const;
  void layRegions(const BoxSet& boxes, int threads);
  void splitSample(std::uint32_t split, std::uint32_t first, std::uint32_t count, Centre* begin,
                   Centre* end);
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
