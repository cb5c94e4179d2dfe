// Which geom is in which slot.
#pragma once

#include <cstddef>
#include <cstdint>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
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
  // `unlink` takes the geom out of that list, as ODE does it. With `keep_size` the next geom gets
  // none of the slots of now.
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

}  // namespace ode_parallel_sap
