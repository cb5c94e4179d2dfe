// The geoms of a block that have moved and are of the simplest classes: their bounds and boxes are
// made together, class by class. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <cstdint>

#include "space/data/box_set.h"
#include "space/simd/kernels.h"
#include "space/update/stock_bounds.h"
#include "space/update/tuning.h"

namespace ode_parallel_sap {

// Needs exactMode(), which is the caller's own mode, too. What is taken is clean from then on.
class MovedShapes {
 public:
  MovedShapes(const StockBounds& stock, PackShapes packShapes)
      : stock_(stock), pack_shapes_(packShapes) {}

  // How many of each class were taken, a byte each, which the caller keeps in a register: lists
  // that know their own length wait for it (0.4 ns a geom).
  using Counts = std::uint32_t;

  // Takes an enabled geom of these classes, whose pose is good and whose bounds are not; of a block
  // at most.
  bool take(dxGeom* geom, Slot slot, Counts& counts) {
    constexpr int asked = bad | GEOM_POSR_BAD | GEOM_ENABLE_TEST_MASK;
    const int flags = geom->gflags;
    if ((flags & asked) != (bad | GEOM_ENABLE_TEST_VALUE) || !stock_.knowsShape(geom)) return false;
    geom->gflags = flags & ~bad;
    const int of = geom->type, shift = 8 * of;
    const std::size_t place = counts >> shift & 0xff;
    counts += Counts{1} << shift;
    geoms_[of][place] = geom;
    slots_[of][place] = slot;
    return true;
  }

  struct Packed {
    std::size_t count = 0;
    bool all = true;    // that were taken; the others are as bad as before
    bool exact = true;  // no bound was rounded
  };
  // Writes bounds and boxes of what was taken.
  Packed pack(Counts counts, Box* boxes) {
    Packed packed;
    for (int of = 0; of < StockBounds::shapes; ++of) {
      const std::size_t count = counts >> 8 * of & 0xff;
      if (!count) continue;
      const auto* const any = static_cast<const dxGeom*>(geoms_[of][0]);
      const PackedShapes done =
          pack_shapes_(StockBounds::shapeOf(any), {geoms_[of], slots_[of], count},
                       StockBounds::layoutOf(any), boxes);
      packed.all = packed.all && done.fine;
      if (done.fine) {
        packed.count += count;
        packed.exact = packed.exact && done.exact;
      } else {
        for (std::size_t i = 0; i < count; ++i) static_cast<dxGeom*>(geoms_[of][i])->gflags |= bad;
      }
    }
    return packed;
  }

 private:
  static constexpr int bad = GEOM_DIRTY | GEOM_AABB_BAD;

  static_assert(prefetched_block < 256 && StockBounds::shapes <= 4, "a byte for each count");

  const StockBounds& stock_;
  const PackShapes pack_shapes_;
  // By class.
  void* geoms_[StockBounds::shapes][prefetched_block];
  Slot slots_[StockBounds::shapes][prefetched_block];
};

}  // namespace ode_parallel_sap
