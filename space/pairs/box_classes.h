// Boxes divided by filter bits, size and shape, so that a large or long box does not blow up the
// cells of others, and boxes that no bits let meet are in cells of their own.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/pairs/quantizer.h"

namespace ode_parallel_sap {

// A box is long on an axis if it is longer than the mean there, where those are far longer than the
// others. Filter bits count if there are few kinds of them, and much of all pairs is of kinds that
// do not meet. Both are decided on a sample of the boxes: any division leads to the same pairs.
template <class Real>
class BoxClasses {
 public:
  // Chooses the classes for the boxes that are not NaN, and summarises each.
  void choose(const BoxSet& boxes, int threads);

  // Small boxes first; of those that have boxes.
  std::size_t count() const { return classes_.size(); }
  const ClassSummary<Real>& summary(std::size_t index) const { return classes_[index].summary; }
  // Whether its boxes have infinite extents, or ones beyond the type.
  bool isUnbounded(std::size_t index) const { return classes_[index].number % shapes == unbounded; }
  // The class of a box that is not NaN.
  std::size_t of(const BoxSet& boxes, Slot slot) const { return index_of_[numberOf(boxes, slot)]; }
  std::size_t bytes() const { return bytesOf(classes_, surveys_); }

 private:
  static constexpr int unbounded = 8, shapes = 9;  // fixed: long or not on three axes; unbounded
  // fixed: more are one kind: each class's boxes walk every other class's tree.
  static constexpr std::size_t most_kinds = 4;
  static constexpr std::size_t most = most_kinds * shapes;

  struct Class {
    int number;
    ClassSummary<Real> summary;
  };
  struct alignas(64) Survey {
    std::array<ClassSummary<Real>, most> summaries;  // by number
  };

  void chooseLengths(const BoxSet& boxes);
  void chooseKinds(const BoxSet& boxes);
  int numberOf(const BoxSet& boxes, Slot slot) const;

  Real most_short_[3];  // the greatest extents of boxes that are not long
  std::size_t kinds_ = 1;
  FilterBits bits_[most_kinds];  // read if there are several kinds
  std::vector<Class> classes_;
  std::array<std::uint8_t, most> index_of_;
  std::vector<Survey> surveys_;  // one a thread
};

}  // namespace ode_parallel_sap
