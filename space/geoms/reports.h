// What callbacks do to a space that reports pairs. Sees ODE's private headers.
#pragma once

#include <cstddef>

#include "space/base/buffer.h"
#include "space/base/slot_set.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// A space is locked while it finds pairs. While it reports them on the calling thread, ODE sees it
// unlocked, so that callbacks may destroy geoms. Until the outermost report has ended, no slot gets
// another geom: a report knows its geoms by their slots, which are empty once these have left.
class Reports {
 public:
  // null: one in which nothing may change.
  explicit Reports(dxSpace* space) : space_(space) {}

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

  // Makes room for slots below `slots`.
  void growTo(std::size_t slots) { changed_spaces_.growTo(slots); }
  // A call begins that is within no other one.
  void begin() {
    if (!changed_) return;
    changed_ = false;
    changed_spaces_.clear();
  }
  // A geom came or left.
  void noteChange() { changed_ = true; }
  // One came, left or moved in the sub-space of a slot. (Only the first time is ODE sure to say
  // so.)
  void noteChangeWithin(const dxSpace* space, Slot slot) {
    if (!changed_spaces_.contains(slot)) mark(space);
    changed_spaces_.insert(slot);
    changed_ = true;
  }

  // Whether any of this happened since the outermost call began.
  const bool& changed() const { return changed_; }
  // Whether a geom that was in a slot, or in the sub-space there, when a report began still is.
  bool holds(const Buffer<dxGeom*>& geoms, Slot slot, const dxGeom* geom) const {
    dxGeom* const now = geoms[slot];
    if (!now || now == geom || !changed_spaces_.contains(slot)) return now != nullptr;
    return holdsMarked(static_cast<dxSpace*>(now), geom);
  }

 private:
  // Marks the geoms of a sub-space, so that one that comes later at the address of one of them can
  // be told from it. Marks stay: no pair of a later report has a geom that such a one could be
  // taken for.
  static constexpr int marked = 1 << 30;  // fixed: in gflags, where ODE uses the lower bits
  static void mark(const dxSpace* space) {
    for (dxGeom* own = space->first; own; own = own->next)
      if (IS_SPACE(own))
        mark(static_cast<dxSpace*>(own));
      else
        own->gflags |= marked;
  }
  static bool holdsMarked(const dxSpace* space, const dxGeom* geom) {
    for (const dxGeom* own = space->first; own; own = own->next)
      if (IS_SPACE(own) ? holdsMarked(static_cast<const dxSpace*>(own), geom) : own == geom)
        return IS_SPACE(own) || (own->gflags & marked);
    return false;
  }

  dxSpace* const space_;
  bool changed_ = false;
  SlotSet changed_spaces_;
};

}  // namespace ode_parallel_sap
