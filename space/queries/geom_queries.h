// Which geoms of a space another geom's AABB overlaps: dSpaceCollide2. Sees ODE's private headers.
#pragma once

#include <cstddef>

#include "space/base/buffer.h"
#include "space/base/slot_set.h"
#include "space/geoms/pack_rules.h"
#include "space/queries/geom_tree.h"

struct dxGeom;

namespace ode_parallel_sap {

// Walks a GeomTree where queries come often enough to pay for it; tests geom by geom where they do
// not.
class GeomQueries {
 public:
  using Geoms = Buffer<dxGeom*>;  // by slot, null where there is none

  void changed(std::size_t slot) { tree_.changed(slot); }
  void reset() { tree_.reset(); }
  // As of the tree.
  bool clean(const Geoms& geoms) { return tree_.clean(geoms); }

  // Puts into `hits`, in ascending order of their slots, the enabled geoms that are pairs with
  // `geom` by the rules of queries, the AABBTest calls apart. Up to `threads` threads build a tree.
  // All AABBs are up to date, that of `geom` is without NaN. Throws std::bad_alloc where memory
  // ends.
  void find(const Geoms& geoms, dxGeom* geom, const PackRules& rules, int threads,
            Buffer<dxGeom*>& hits);

  // Whether it gave back what it holds.
  bool noteFrame() {
    if (!tree_.noteFrame()) return false;
    release();
    return true;
  }

  // Gives back all that is held.
  void release();
  std::size_t bytes() const { return bytesOf(tree_, found_, marks_); }

 private:
  void findByTree(const Geoms& geoms, const dxGeom* geom, Buffer<dxGeom*>& hits);
  static void findByTests(const Geoms& geoms, const dxGeom* geom, Buffer<dxGeom*>& hits);

  GeomTree tree_;
  // Kept between queries, so that none of them allocates.
  Buffer<Slot> found_;
  SlotSet marks_;  // empty between queries
};

}  // namespace ode_parallel_sap
