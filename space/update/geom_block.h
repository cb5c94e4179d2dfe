// A few geoms that are brought up to date together, and what is asked for ahead of that. Sees ODE's
// private headers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "space/data/parallel.h"
#include "space/data/platform.h"
#include "space/data/tuning.h"
#include "space/geom/geom_prefetch.h"
#include "space/geom/slots.h"
#include "space/update/tuning.h"

namespace ode_parallel_sap {

// What is read of a geom besides its bounds.
inline void prefetchStatus(const dxGeom* geom) {
  prefetch(&geom->gflags);
  prefetch(&geom->body);
  prefetch(&geom->category_bits);
}
// What is read of a geom when its box is made.
inline void prefetchForBox(const dxGeom* geom) {
  if (geom->gflags & GEOM_DIRTY) prefetchPose(geom);
  prefetch(geom->aabb);
}
// Geoms of a list that are brought up to date together. Those that come next are asked for where
// they lie scattered in memory, which the first and the last place tell. What lies in a row the
// processor asks for by itself, and more would be in its way.
template <class SlotOf>
class GeomBlock {
 public:
  // The list ends at `end`.
  GeomBlock(dxGeom* const* geoms, std::size_t begin, std::size_t end, SlotOf slotOf)
      : range_{begin, std::min(begin + update_block, end)}, geoms_(geoms), slotOf_(slotOf) {
    constexpr std::uintptr_t reach = std::uintptr_t{bytes_in_a_row} * (update_block + distance);
    const std::uintptr_t way =
        reinterpret_cast<std::uintptr_t>(geom(std::min(range_.end + distance, end) - 1)) -
        reinterpret_cast<std::uintptr_t>(geom(begin));
    const bool scattered = way + reach > 2 * reach;
    asking_end_ = scattered && end > distance ? end - distance : 0;
  }
  const Range& range() const { return range_; }
  dxGeom* geom(std::size_t i) const { return geoms_[slotOf_(i)]; }

  bool isScattered() const { return asking_end_ > 0; }
  void ask() const {
    for (std::size_t i = range_.begin; i < range_.end; ++i) {
      if (i < asking_end_)
        if (const dxGeom* const later = geom(i + distance)) prefetchStatus(later);
      if (const dxGeom* const own = geom(i)) prefetchForBox(own);
    }
  }

 private:
  static constexpr std::size_t distance = prefetch_distance / 2;
  // fixed: more than a geom takes with its pose, a body and what else a program makes for it.
  static constexpr std::size_t bytes_in_a_row = 2048;

  const Range range_;
  dxGeom* const* const geoms_;
  const SlotOf slotOf_;
  std::size_t asking_end_;
};

}  // namespace ode_parallel_sap
