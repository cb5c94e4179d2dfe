// The reports of one call. Sees ODE's private headers.
#pragma once

#include <cstdint>

#include "space/geoms/edits.h"

namespace ode_parallel_sap {

// A space is locked while it finds pairs. While it reports them on the calling thread, ODE sees it
// unlocked, so that callbacks may destroy geoms. Until the outermost call has ended, no slot gets
// another geom.
class Reports {
 public:
  // Of a call that begins. Nothing may have changed between this and its search for pairs.
  Reports(dxSpace* space, Edits& edits, const Edits::Geoms& geoms)
      : space_(space),
        edits_(&edits),
        last_change_(&edits.lastChange()),
        begin_(edits.begin(geoms)) {}
  // Nothing may change in one.
  Reports() = default;

  // While it lives, ODE sees the space unlocked. A longjmp out of it leaves the space so.
  class Open {
   public:
    explicit Open(const Reports& reports, bool opens = true)
        : space_(opens ? reports.space_ : nullptr) {
      if (space_) --space_->lock_count;
    }
    ~Open() {
      if (space_) ++space_->lock_count;
    }
    Open(const Open&) = delete;
    Open& operator=(const Open&) = delete;

   private:
    dxSpace* const space_;
  };

  // Whether a geom came or left since the call began, or something changed in a stock space.
  bool changed() const { return *last_change_ >= begin_; }
  // Whether a geom that was in a slot, or in the sub-space there, when the call began has stayed.
  bool holds(const Edits::Geoms& geoms, Slot slot, const dxGeom* geom) const {
    return edits_->holds(geoms, slot, geom, begin_);
  }

 private:
  dxSpace* space_ = nullptr;
  Edits* edits_ = nullptr;
  static constexpr std::uint64_t never = 0;
  const std::uint64_t* last_change_ = &never;
  std::uint64_t begin_ = 1;
};

}  // namespace ode_parallel_sap
