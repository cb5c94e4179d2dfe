// Scenes so small that they need no boxes.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <cstdint>

#include "space/base/buffer.h"
#include "space/base/tuning.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// Places in a list of geoms; read as they are written, in one word.
struct PlacePair {
  static_assert(small_scene_slots <= 0x80, "a place has seven bits");
  std::uint16_t places;
  unsigned earlier() const { return places >> 8; }
  unsigned later() const { return places & 0x7f; }
  // Boxes that overlap, but are no pair.
  bool isLeftOut() const { return places & 0x80; }
  void leaveOut(bool out) {
    places = static_cast<std::uint16_t>((places & ~0x80) | (out ? 0x80 : 0));
  }
};

// What a small frame finds: not on the stack, which may be small, and deep in nested callbacks.
struct SmallLists {
  Buffer<dxGeom*> active;   // the geoms that take part
  Buffer<PlacePair> pairs;  // of places in these: the boxes that overlap
  Buffer<Group<dReal>> boxes;
  unsigned actives = 0, overlaps = 0, unbounded = 0;
  bool user_classes = false;  // among the geoms
  bool takes_all = false;     // all overlaps are pairs
  bool same = false;          // the pairs are those of the frame before
  // How often a geom had become dirty, come or gone when the last frame began; 0: none has.
  std::uint64_t changes = 0;

  // For all pairs of so many geoms. False without memory for it.
  bool makeRoom(std::size_t geoms) { return geoms <= active.size() || grow(geoms); }
  std::size_t bytes() const { return bytesOf(active, pairs, boxes); }

 private:
  bool grow(std::size_t geoms);
};

}  // namespace ode_parallel_sap
