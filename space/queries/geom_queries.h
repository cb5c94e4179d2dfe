// Which geoms of a space another geom's AABB overlaps: dSpaceCollide2. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "space/data/buffer.h"
#include "space/queries/geom_tree.h"

struct dxGeom;

namespace ode_parallel_sap {

// Asks a GeomTree where queries come often enough to pay for it, and tests geom by geom where they
// do not.
class GeomQueries {
 public:
  using Geoms = Buffer<dxGeom*>;  // by slot, null where there is none

  void changed(std::size_t slot) { tree_.changed(slot); }
  bool neverAsked() const { return tree_.neverAsked(); }
  void reset() { tree_.reset(); }
  // As of the tree.
  bool clean(const Geoms& geoms) { return tree_.clean(geoms); }

  // Puts into `hits`, in ascending order of their slots, the enabled geoms that pair with `geom`
  // by ODE's formula, the AABBTest calls apart, and, if `cull_planes`, are not clear of a plane
  // that is one of the two. All AABBs are up to date, that of `geom` is without NaN. Throws
  // std::bad_alloc where memory ends.
  void find(const Geoms& geoms, dxGeom* geom, bool cull_planes, int threads, Buffer<dxGeom*>& hits);

  // Storage for hits, kept between queries. One that is taken by a query is free for no other.
  Buffer<dxGeom*> takeHits() { return std::move(hits_); }
  void giveBack(Buffer<dxGeom*>&& hits) { hits_ = std::move(hits); }

  void noteFrame() {
    if (tree_.noteFrame()) release();
  }

  // Gives back all that is held.
  void release();
  std::size_t bytes() const { return bytesOf(tree_, hits_, found_, marks_, marked_words_); }

 private:
  void search(const Geoms& geoms, const dxGeom* geom);
  void decideBorderline(const Geoms& geoms, const dxGeom* geom);
  template <class Visit>
  void forFoundInOrder(std::size_t slots, Visit visit);

  GeomTree tree_;
  Buffer<dxGeom*> hits_;
  Buffer<Slot> found_;
  // A bit a slot, and a bit for each word of those; all 0 between queries.
  Buffer<std::uint64_t> marks_, marked_words_;
};

}  // namespace ode_parallel_sap
