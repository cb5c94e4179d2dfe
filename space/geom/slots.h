// Which geom is in which slot. Sees ODE's private headers.
#ifndef ODE_PARALLEL_SAP_SLOTS_H
#define ODE_PARALLEL_SAP_SLOTS_H

#include <algorithm>
#include <cstddef>

#include "space/data/box_set.h"
#include "space/data/buffer.h"
#include "space/geom/ode_private.h"

namespace ode_parallel_sap {

// Geoms sit in slots in the order in which they were added; a removed one leaves its slot empty
// until the slots are closed up. A geom knows its slot: slot + 1 is kept in dxGeom::tome_ex, a
// field that ODE leaves to spaces for this.
class Slots {
 public:
  static constexpr std::size_t most = std::size_t{1} << 28;  // fixed: bits of a slot in pairs

  static Slot slotOf(const dxGeom* geom) {
    return static_cast<Slot>(reinterpret_cast<std::size_t>(geom->tome_ex) - 1);
  }
  // By slot, null where there is none.
  const Buffer<dxGeom*>& geoms() const { return geoms_; }
  std::size_t size() const { return geoms_.size(); }
  bool full() const { return size() >= most; }

  // The slot of the next geom that is added.
  Slot next() const { return static_cast<Slot>(size()); }
  void add(dxGeom* geom) {
    geoms_.push_back(geom);
    place(geom, size() - 1);
  }
  void remove(dxGeom* geom) {
    geoms_[slotOf(geom)] = nullptr;
    while (geoms_.size() && !geoms_[geoms_.size() - 1]) geoms_.resize(geoms_.size() - 1);
    geom->tome_ex = nullptr;
  }
  // Whether the gaps are a quarter of all slots. `count`: of geoms.
  bool worthClosing(std::size_t count) const {
    const std::size_t gaps = size() - count;
    return gaps > 0 && gaps >= size() / 4;
  }
  // Whether a geom more would be better added without gaps.
  bool mustClose(std::size_t count) const {
    constexpr std::size_t least_gaps = 64;  // fixed: any number that is not worth it
    return size() - count >= std::max(least_gaps, count);
  }
  // Closes the gaps. Geoms keep their order.
  void close() {
    std::size_t slot = 0;
    for (dxGeom* const geom : geoms_) {
      if (!geom) continue;
      geoms_[slot] = geom;
      place(geom, slot++);
    }
    geoms_.resize(slot);
  }
  void shrink() { geoms_.shrink(); }
  std::size_t bytes() const { return geoms_.bytes(); }

 private:
  static void place(dxGeom* geom, std::size_t slot) {
    geom->tome_ex = reinterpret_cast<dxGeom**>(slot + 1);
  }

  Buffer<dxGeom*> geoms_;
};

}  // namespace ode_parallel_sap

#endif
