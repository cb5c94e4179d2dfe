// The geoms of a space, as a frame sees them, and the reports of a call.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "space/base/buffer.h"
#include "space/geoms/edits.h"
#include "space/geoms/geom_tests.h"

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

struct Scene {
  dxGeom* first;                 // of the list, in the order in which geoms were added
  std::size_t count;             // of geoms
  const Buffer<dxGeom*>& slots;  // the same with gaps: null where a geom was removed
  bool nested;                   // the space is being collided already
  std::atomic<bool>& needs_clean;
  const Reports reports = {};  // of the call

  // No geom is dirty any more, for other threads too.
  void noteClean() const { needs_clean.store(false, std::memory_order_release); }
};

// How many geoms were brought up to date, and whether code of the program did it for some.
struct Cleaned {
  unsigned moved = 0;
  bool by_others = false;
};
// Brings the AABBs of all dirty geoms up to date, on this thread. Not inline: the loop needs all
// registers, and spaces in spaces little of the stack.
__attribute__((noinline)) inline Cleaned cleanOneByOne(dxGeom* first) {
  Cleaned cleaned;
  for (dxGeom* geom = first; geom; geom = geom->next) {
    if (!(geom->gflags & GEOM_DIRTY)) continue;
    ++cleaned.moved;
    cleaned.by_others = cleaned.by_others || needsCallingThread(geom);
    cleanGeom(geom);
  }
  return cleaned;
}

}  // namespace ode_parallel_sap
