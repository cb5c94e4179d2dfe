// An order of the boxes in which any sixteen in a row are near each other and of like size.
#ifndef ODE_PARALLEL_SAP_CELL_ORDER_H
#define ODE_PARALLEL_SAP_CELL_ORDER_H

#include <array>
#include <cstdint>
#include <vector>

#include "box_set.h"
#include "buffer.h"
#include "parallel.h"
#include "quantizer.h"

namespace ode_parallel_sap {

// Boxes are first divided into classes of like size and shape, so that a large or long box does not
// blow up the cells of small ones. Within a class they are sorted along a space-filling curve whose
// steps follow the class's mean extents; where the curve is too coarse for the density it is laid
// again through the crowded place alone. Cells are then sixteen boxes in a row: they hold equal
// numbers whatever the distribution, and no length has to be chosen by anyone.
//
// The order is a means only: it decides how long finding the pairs takes, never which are found.
class CellOrder {
 public:
  // The classes' boxes are consecutive in order(), small sizes first, unbounded boxes last.
  struct Class {
    std::size_t begin, end;
  };

  // Orders all boxes of `boxes` that are not NaN.
  void build(const BoxSet& boxes, int threads);

  const std::uint32_t* order() const { return order_.data(); }
  const std::vector<Class>& classes() const { return classes_; }
  std::size_t bytes() const;

 private:
  static constexpr int max_classes = 24;
  static constexpr int bins = 256 * 8;  // octave of the largest extent, shape
  using ClassTable = std::array<std::uint8_t, bins>;

  struct alignas(64) Survey {
    std::array<std::uint32_t, bins> histogram;
    std::array<ClassSummary, max_classes> classes;
  };

  static unsigned binOf(const Box& box);
  ClassTable chooseClasses(const std::array<std::uint32_t, bins>& histogram);
  void survey(const BoxSet& boxes, int threads);
  void assignKeys(const BoxSet& boxes, int threads);
  void refineLongRuns(const BoxSet& boxes, int threads);
  void refine(const BoxSet& boxes, std::size_t begin, std::size_t end, std::size_t class_begin,
              int threads, int round);

  ClassTable table_ = {};
  int class_count_ = 0;
  Survey total_;
  std::vector<Survey> surveys_;
  std::vector<Quantizer> quantizers_;
  std::vector<Class> classes_;
  std::vector<std::size_t> part_counts_;
  int key_bits_ = 0;
  Buffer<std::uint64_t> records_, scratch_;  // key above slot
  Buffer<std::uint32_t> order_;
};

}  // namespace ode_parallel_sap

#endif
