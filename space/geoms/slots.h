// Which geom is in which slot. Sees ODE's private headers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/geoms/ode_private.h"
#include "space/geoms/slot_home.h"

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
// until the slots are closed up. A geom knows its slot: slot + 1 is kept in it (SlotHome). Where
// that takes the place of dxGeom::tome, the pointers back are kept here, by slot.
class Slots {
 public:
  static constexpr std::size_t most = std::size_t{1} << 28;  // fixed: bits of a slot in pairs

  static Slot slotOf(const dxGeom* geom) { return static_cast<Slot>(SlotHome::get(geom) - 1); }
  // By slot, null where there is none.
  const Buffer<dxGeom*>& geoms() const { return geoms_; }
  std::size_t size() const { return geoms_.size(); }
  bool full() const { return size() >= most; }
  // The geom that so many of all `count` geoms precede. Throws std::bad_alloc.
  dxGeom* at(std::size_t index, std::size_t count) {
    if (size() == count) return geoms_[index];
    if (ranks_.size() == 0) {
      ranks_.resizeDiscarding(size());
      for (std::size_t slot = 0; slot < size(); ++slot) rank(slot);
    }
    std::size_t node = 0;
    for (std::size_t step = most; step; step /= 2)
      if (node + step <= size() && ranks_[node + step - 1] <= index)
        index -= ranks_[(node += step) - 1];
    return geoms_[node];
  }

  // The slot of the next geom that is added.
  Slot next() const { return static_cast<Slot>(size()); }
  // The geom comes to the end of the list of the base class, whose last pointer is `tome`.
  void add(dxGeom* geom, dxGeom** tome) {
    if (SlotHome::takes_tome) tomes_.resize(size() + 1);  // what may throw comes first
    if (ranks_.size()) ranks_.resize(size() + 1);
    geoms_.push_back(geom);
    if (ranks_.size()) rank(size() - 1);
    if (SlotHome::takes_tome)
      tomes_[size() - 1] = tome;
    else
      geom->tome = tome;
    place(geom, size() - 1);
  }
  dxGeom** tomeOf(const dxGeom* geom) const {
    return SlotHome::takes_tome ? tomes_[slotOf(geom)] : geom->tome;
  }
  // `unlink` takes the geom out of that list, as ODE does it. With `keep_size` the next geom gets
  // none of the slots of now.
  template <class Unlink>
  void remove(dxGeom* geom, bool keep_size, Unlink unlink) {
    const Slot slot = slotOf(geom);
    dxGeom** const tome = tomeOf(geom);
    dxGeom* const next = geom->next;
    const Slot next_slot = next ? slotOf(next) : slot;
    SlotHome::put(geom, 0);
    geom->tome = tome;
    unlink();
    geoms_[slot] = nullptr;
    if (ranks_.size())
      for (std::size_t node = slot + 1; node <= size(); node += node & -node) --ranks_[node - 1];
    if (SlotHome::takes_tome && next) {  // ODE has written the pointer where the number was
      tomes_[next_slot] = tome;
      place(next, next_slot);
    }
    while (!keep_size && geoms_.size() && !geoms_[geoms_.size() - 1])
      geoms_.resize(geoms_.size() - 1);
    if (SlotHome::takes_tome) tomes_.resize(size());
    if (size() == 0) ranks_.resize(0);
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
      if (SlotHome::takes_tome) tomes_[slot] = tomes_[slotOf(geom)];
      geoms_[slot] = geom;
      place(geom, slot++);
    }
    geoms_.resize(slot);
    if (SlotHome::takes_tome) tomes_.resize(slot);
    ranks_.resize(0);
  }
  void shrink() {
    geoms_.shrink();
    tomes_.shrink();
    ranks_.release();
  }
  std::size_t bytes() const { return bytesOf(geoms_, tomes_, ranks_); }

 private:
  static void place(dxGeom* geom, std::size_t slot) { SlotHome::put(geom, slot + 1); }
  // Counts the geoms of a node's slots, the last of which is this one, by the nodes before.
  void rank(std::size_t slot) {
    std::uint32_t geoms = geoms_[slot] ? 1 : 0;
    for (std::size_t node = slot; node != (slot & (slot + 1)); node &= node - 1)
      geoms += ranks_[node - 1];
    ranks_[slot] = geoms;
  }

  Buffer<dxGeom*> geoms_;
  Buffer<dxGeom**> tomes_;       // empty where dxGeom::tome is itself
  Buffer<std::uint32_t> ranks_;  // a Fenwick tree of the geoms; empty until at() needs it
};

}  // namespace ode_parallel_sap
