// Geoms that ODE makes dirty without a word to their space. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <vector>

#include "space/data/buffer.h"
#include "space/data/slot_set.h"

struct dxGeom;
struct dxSpace;

namespace ode_parallel_sap {

// dGeomTriMeshSetData makes a mesh dirty by itself. dGeomMoved, which tells the spaces of clean
// geoms only, then says nothing of it, nor of the spaces around it. So a space asks its meshes, its
// sub-spaces and the meshes within these, at any depth, before it relies on what it knows of them.
// (Where the program itself cleans or collides a stock sub-space first, ODE erases the trace, and
// the bounds of that sub-space are stale in any space.) They are listed, so that this takes a look
// at one flag each and at no other geom.
class SilentGeoms {
 public:
  // Makes room for slots below `slots`.
  void growTo(std::size_t slots) { slots_.growTo(slots); }
  // A geom comes to a slot or leaves it. Of which kind it is is asked later: a geom is added before
  // its constructor has set its type.
  void add(Slot slot) {
    slots_.insert(slot);
    listed_ = false;
  }
  void remove(Slot slot) {
    if (!slots_.contains(slot)) return;
    slots_.erase(slot);
    listed_ = false;
  }
  // The slots are numbered anew: all are to be added again.
  void clear() {
    slots_.clear();
    watched_.clear();
    listed_ = false;
  }

  // Has dirty() of `space`, whose geoms these are, called for each of them that is dirty or holds a
  // mesh that was made dirty silently, and makes the spaces that hold it dirty. Calls it for those
  // that it has been called for already, too, until they are clean.
  void ask(dxSpace& space, dxGeom* const* geoms) {
    if (!listed_ || (!asked_.empty() && anyDirty())) askAll(space, geoms);
  }
  // Adds the meshes of `space`, and those within its sub-spaces, to `meshes`.
  void addMeshes(dxGeom* const* geoms, std::vector<dxGeom*>& meshes);
  // All meshes and spaces, and geoms that are not listed yet.
  const SlotSet& slots() const { return slots_; }
  std::size_t bytes() const { return bytesOf(slots_, watched_, asked_); }

 private:
  struct Watched {
    Slot slot;
    dxGeom* geom;
    // Of a sub-space: the meshes within, which stay there while it is clean, if they are listed.
    std::vector<dxGeom*> meshes;
    bool listed = false;

    std::size_t bytes() const { return bytesOf(meshes); }
  };

  bool anyDirty() const;
  void askAll(dxSpace& space, dxGeom* const* geoms);
  static void askSubspace(Watched& subspace);
  void list(dxGeom* const* geoms);
  void listAsked();

  SlotSet slots_;
  bool listed_ = true;
  std::vector<Watched> watched_;  // ascending
  // All of these, the sub-spaces first, and the meshes within sub-spaces.
  std::vector<const dxGeom*> asked_;
  std::size_t asked_spaces_ = 0;
};

// What dGeomMoved does to the spaces around a geom, but without its assertion that they are not
// locked. Tells them of each other, if `telling`.
void makeDirty(dxSpace* space, bool telling);

// Whether ODE may make it dirty without a call of dirty().
bool mayBeSilent(const dxGeom* geom);

}  // namespace ode_parallel_sap
