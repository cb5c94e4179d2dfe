// Boxes divided by size and shape, so that a large or long box does not blow up the cells of
// others.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "space/cells/quantizer.h"
#include "space/data/box_set.h"
#include "space/data/buffer.h"
#include "space/data/size_rules.h"

namespace ode_parallel_sap {

template <class Real>
class SizeClasses {
 public:
  static constexpr int most = size_rules::most_classes;

  // Chooses the classes for the boxes that are not NaN and summarises each: those of one group
  // where `group_of_slot` is not null.
  void choose(const BoxSet& boxes, int threads, const std::uint8_t* group_of_slot = nullptr,
              std::uint8_t group = 0);

  // Small sizes first; the last one may be that of unbounded boxes.
  int count() const { return count_; }
  const ClassSummary<Real>& summary(int index) const { return total_.classes[index]; }
  bool isUnbounded(int index) const { return has_unbounded_ && index == count_ - 1; }
  // The class of a box that is not NaN.
  int of(const BasicBox<Real>& box) const { return table_[binOf(box)]; }
  std::size_t bytes() const { return bytesOf(surveys_); }

 private:
  static constexpr int bins = size_rules::bins;
  using Histogram = std::array<std::uint32_t, bins>;
  using Table = std::array<std::uint8_t, bins>;

  struct alignas(64) Survey {
    Histogram histogram = {};
    int first = bins, last = -1;  // bins; those before and after are empty
    std::array<ClassSummary<Real>, most> classes;

    void clear();
    void count(int bin);
    void add(const Survey& other);
  };
  static int binOf(const BasicBox<Real>& box);
  static std::vector<size_rules::Window> chooseWindows(const Survey& survey);
  Table chooseTable(const Survey& survey);

  Table table_ = {};
  int count_ = 0;
  bool has_unbounded_ = false;
  Survey total_;
  std::vector<Survey> surveys_;
};

}  // namespace ode_parallel_sap
