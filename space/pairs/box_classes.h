// Boxes divided by size and shape, so that a large or long box does not blow up the cells of
// others.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/pairs/quantizer.h"

namespace ode_parallel_sap {

// A box is long on an axis if it is longer than the mean there, where those are far longer than the
// others. A sample of the boxes decides that: any division leads to the same pairs.
template <class Real>
class BoxClasses {
 public:
  // Chooses the classes for the boxes that are not NaN, and summarises each.
  void choose(const BoxSet& boxes, int threads);

  // Small boxes first; of those that have boxes.
  std::size_t count() const { return classes_.size(); }
  const ClassSummary<Real>& summary(std::size_t index) const { return classes_[index].summary; }
  // Whether its boxes have infinite extents, or ones beyond the type.
  bool isUnbounded(std::size_t index) const { return classes_[index].number == unbounded; }
  // The class of a box that is not NaN.
  std::size_t of(const BasicBox<Real>& box) const { return index_of_[numberOf(box)]; }
  std::size_t bytes() const { return bytesOf(classes_, surveys_); }

 private:
  static constexpr int unbounded = 8, shapes = 9;  // fixed: long or not on three axes; unbounded

  struct Class {
    int number;
    ClassSummary<Real> summary;
  };
  struct alignas(64) Survey {
    std::array<ClassSummary<Real>, shapes> summaries;  // by number
  };

  void chooseLengths(const BoxSet& boxes);
  int numberOf(const BasicBox<Real>& box) const;

  Real most_short_[3];  // the greatest extents of boxes that are not long
  std::vector<Class> classes_;
  std::array<std::uint8_t, shapes> index_of_;
  std::vector<Survey> surveys_;  // one a thread
};

}  // namespace ode_parallel_sap
