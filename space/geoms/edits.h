// What callbacks change in a space while its calls report.
#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

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
  // Something changed in the sub-space of a slot, at any depth; or a geom came there, or is about
  // to leave.
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

  // ODE's enumerator of a space, which each change of its list resets and dSpaceGetGeom(), by its
  // index, takes for none.
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
  void forgetAll();

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

}  // namespace ode_parallel_sap
