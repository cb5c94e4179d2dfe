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
  // Writes bounds and boxes of what was taken; noteCoarse(slot) is told whose boxes are coarse.
  template <class NoteCoarse>
  Packed pack(Counts counts, Box* boxes, NoteCoarse noteCoarse) {
    Packed packed;
    for (int of = 0; of < StockBounds::shapes; ++of) {
      const std::size_t count = counts >> 8 * of & 0xff;
      if (!count) continue;
      const auto* const any = static_cast<const dxGeom*>(geoms_[of][0]);
      const PackedShapes done =
          pack_shapes_(StockBounds::shapeOf(any), {geoms_[of], slots_[of], count},
                       StockBounds::layoutOf(any), boxes);
      const std::uint64_t others = ~std::uint64_t{0} >> (64 - count) & ~(done.fine | done.coarse);
      packed.all = packed.all && !others;
      packed.count += count - static_cast<std::size_t>(__builtin_popcountll(others));
      packed.exact = packed.exact && done.exact;
      for (std::uint64_t bits = done.coarse; bits; bits &= bits - 1)
        noteCoarse(slots_[of][__builtin_ctzll(bits)]);
      for (std::uint64_t bits = others; bits; bits &= bits - 1)
        static_cast<dxGeom*>(geoms_[of][__builtin_ctzll(bits)])->gflags |= bad;
    }
    return packed;
  }

 private:
  static constexpr int bad = GEOM_DIRTY | GEOM_AABB_BAD;

  static_assert(update_block <= 64 && StockBounds::shapes <= 4,
                "a bit for each of a list, a byte for its count");

  const StockBounds& stock_;
  const PackShapes pack_shapes_;
  // By class.
  void* geoms_[StockBounds::shapes][update_block];
  Slot slots_[StockBounds::shapes][update_block];
};

}  // namespace ode_parallel_sap
