// The geoms of a space, as a frame sees them, and the reports of a call.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/geoms/geom_tests.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// Makes a table by slot follow what Slots::close() is about to do to these geoms, as far as it
// reaches. Returns how many of its entries stay.
template <class Table>
std::size_t closeGaps(const Buffer<dxGeom*>& geoms, Table& table) {
  std::size_t stay = 0;
  for (std::size_t slot = 0; slot < geoms.size() && slot < table.size(); ++slot)
    if (geoms[slot]) table[stay++] = table[slot];
  return stay;
}

// Geoms sit in slots in the order in which they were added; a removed one leaves its slot empty
// until the slots are closed up. A geom knows its slot: slot + 1 is in dxGeom::tome, a field that
// is the space's. ODE keeps there the pointer back to the geom in the list of the base class, and
// reads it when a geom leaves that list and at no other time. So these pointers are kept here.
class Slots {
 public:
  static constexpr std::size_t most = std::size_t{1} << 28;  // fixed: bits of a slot in pairs

  static Slot slotOf(const dxGeom* geom) {
    return static_cast<Slot>(reinterpret_cast<std::uintptr_t>(geom->tome) - 1);
  }
  // By slot, null where there is none.
  const Buffer<dxGeom*>& geoms() const { return geoms_; }
  std::size_t size() const { return geoms_.size(); }
  bool full() const { return size() >= most; }

  // The slot of the next geom that is added.
  Slot next() const { return static_cast<Slot>(size()); }
  // The geom comes to the end of the list of the base class, whose last pointer is `tome`.
  void add(dxGeom* geom, dxGeom** tome) {
    tomes_.resize(size() + 1);  // what may throw comes first
    geoms_.push_back(geom);
    tomes_[size() - 1] = tome;
    place(geom, size() - 1);
  }
  dxGeom** tomeOf(const dxGeom* geom) const { return tomes_[slotOf(geom)]; }
  // `unlink` takes the geom out of ODE's list. With `keep_size` the next geom gets a new slot.
  template <class Unlink>
  void remove(dxGeom* geom, bool keep_size, Unlink unlink) {
    const Slot slot = slotOf(geom);
    dxGeom** const tome = tomes_[slot];
    dxGeom* const next = geom->next;
    const Slot next_slot = next ? slotOf(next) : slot;
    geom->tome = tome;
    unlink();
    geoms_[slot] = nullptr;
    if (next) {  // ODE has written the pointer where the number was
      tomes_[next_slot] = tome;
      place(next, next_slot);
    }
    while (!keep_size && geoms_.size() && !geoms_[geoms_.size() - 1])
      geoms_.resize(geoms_.size() - 1);
    tomes_.resize(size());
  }
  // Whether the gaps are a quarter of all slots. `count`: of geoms.
  bool worthClosing(std::size_t count) const {
    const std::size_t gaps = size() - count;
    return gaps > 0 && gaps >= size() / 4;
  }
  // Closes the gaps. Geoms keep their order.
  void close() {
    std::size_t slot = 0;
    for (dxGeom* const geom : geoms_) {
      if (!geom) continue;
      tomes_[slot] = tomes_[slotOf(geom)];
      geoms_[slot] = geom;
      place(geom, slot++);
    }
    geoms_.resize(slot);
    tomes_.resize(slot);
  }
  // ODE's list has the geoms of all slots in their order, each with its slot and the pointer to it.
  void validate(const dxGeom* first, std::size_t count) const;
  void shrink() {
    geoms_.shrink();
    tomes_.shrink();
  }
  std::size_t bytes() const { return bytesOf(geoms_, tomes_); }

 private:
  static void place(dxGeom* geom, std::size_t slot) {
    geom->tome = reinterpret_cast<dxGeom**>(slot + 1);
  }

  Buffer<dxGeom*> geoms_;
  Buffer<dxGeom**> tomes_;
};

// Calls have numbers that only grow, also after a longjmp. A geom of the space itself is known by
// its slot, which no other geom gets while a call runs. From the first change in a sub-space on its
// geoms are in a table, each with the number of the last call that began before it came.
//
// Spaces of ours say what comes and leaves. A stock space does not, so its list is compared with
// the table when a call begins, and before a report of one of its geoms. A geom that left it and
// came back in between is taken for one that stayed; another one at its address is not.
class Edits {
 public:
  using Geoms = Buffer<dxGeom*>;  // of the space, by slot

  // All other calls have ended.
  void clear() {
    if (tables_ || lost_) forgetAll();
  }
  // A call begins. Returns its number.
  std::uint64_t begin(const Geoms& geoms) {
    if (tables_) updateAll(geoms);
    return ++now_;
  }

  // A geom came or left.
  void noteChange() { last_change_ = now_; }
  // In the sub-space of a slot, at any depth, something changed, a geom came or is about to leave.
  void noteWithin(const Geoms& geoms, Slot slot);
  void noteCame(const Geoms& geoms, Slot slot, dxGeom* geom);
  void noteLeaving(const Geoms& geoms, Slot slot, const dxGeom* geom);

  // The call that had begun last when any of this happened; 0: none.
  const std::uint64_t& lastChange() const { return last_change_; }
  // Whether a geom that was in a slot, or in the sub-space there, when the call began has stayed.
  bool holds(const Geoms& geoms, Slot slot, const dxGeom* geom, std::uint64_t begin);

  // The table has the geoms of each sub-space that it follows, once.
  void validate(const Geoms& geoms) const;

  // Keeps the stamp of a space through a change of which it says what comes and leaves.
  class Announced {
   public:
    explicit Announced(dxSpace* space) : space_(space), stamped_(isStamped(space)) {}
    ~Announced() { space_->current_geom = stamped_ ? space_ : nullptr; }
    Announced(const Announced&) = delete;
    Announced& operator=(const Announced&) = delete;

   private:
    dxSpace* const space_;
    const bool stamped_;
  };

 private:
  struct Known {
    Slot slot = 0;
    unsigned scan = 0;  // of the slot, the last that saw it; 0: none
    std::uint64_t identity = 0;
    std::uint64_t came = 0;
  };
  struct Stamped {
    dxSpace* space;
    int stamp;
  };
  // A sub-space in which something changed.
  struct Tracked {
    unsigned scan = 0;
    bool stale = false;           // `spaces` may be gone
    std::vector<Stamped> spaces;  // it and those in it, the outer ones first
  };

  // ODE's enumerator, which each change of the list resets. dSpaceGetGeom() ignores such an index.
  static bool isStamped(const dxSpace* space) {
    return space->current_geom == space && space->current_index < -1;
  }
  static int stampOf(dxSpace* space);
  static bool isFresh(const Tracked& tracked);

  template <class Change>
  void track(const Geoms& geoms, Slot slot, Change change);
  void scan(Slot slot, dxSpace* space, Tracked& tracked);
  void scanWithin(Slot slot, dxSpace* space, Tracked& tracked, std::uint64_t came);
  void updateAll(const Geoms& geoms);
  void forget(const dxGeom* geom);
  void forgetAll(bool for_want_of_memory = false) {
    tables_.reset();
    lost_ = for_want_of_memory;
  }

  std::uint64_t now_ = 0;  // the last call that began
  std::uint64_t last_change_ = 0;
  // Numbers that tell apart geoms of one address. All spaces that have tables share them: in two
  // spaces around a third one a geom has one number.
  class Identities;
  struct Tables {
    std::shared_ptr<Identities> identities;
    std::unordered_map<Slot, Tracked> tracked;
    std::unordered_map<const dxGeom*, Known> known;  // geoms in these
    Tables();
  };
  std::unique_ptr<Tables> tables_;  // from the first change on
  bool lost_ = false;               // no memory: a geom that came back is taken for one that stayed
};

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
