// Which geoms of a space another geom's AABB overlaps: dSpaceCollide2. Sees ODE's private headers.
#ifndef ODE_PARALLEL_SAP_GEOM_QUERIES_H
#define ODE_PARALLEL_SAP_GEOM_QUERIES_H

#include <cstddef>
#include <memory>
#include <utility>

#include "space/data/box_set.h"
#include "space/data/buffer.h"
#include "space/data/tuning.h"

struct dxGeom;

namespace ode_parallel_sap {

// Keeps a QueryTree over the space's geoms where queries come often enough to pay for it, and tests
// geom by geom where they do not. Which of the two only counts decide, of geoms that changed and of
// queries, never times.
//
// What is kept is valid because the space says which slots have changed: changed() for every geom
// that is added, is removed or becomes dirty, reset() where slots are numbered anew. Nothing else
// changes the AABB of a geom that ODE does not call dirty. Bits, bodies and enabled states change
// without notice, so they are not kept but read from the geoms that a query finds.
//
// A space without queries pays a test of a flag for each call of changed().
class GeomQueries {
 public:
  using Geoms = Buffer<dxGeom*>;  // by slot, null where there is none

  GeomQueries();
  ~GeomQueries();
  GeomQueries(const GeomQueries&) = delete;
  GeomQueries& operator=(const GeomQueries&) = delete;

  void changed(std::size_t slot) {
    if (!asked_) return;
    ++changes_;
    if (tree_) note(slot);
  }
  void reset();

  // Brings the dirty ones of the geoms up to date, if it knows them and they are few. False where
  // that is left to the space.
  bool clean(const Geoms& geoms);

  // Puts into `hits`, in ascending order of their slots, the enabled geoms that pair with `geom`
  // by ODE's formula, the AABBTest calls apart, and, if `cull_planes`, are not clear of a plane
  // that is one of the two. All AABBs are up to date, that of `geom` is without NaN. Throws
  // std::bad_alloc where memory ends.
  void find(const Geoms& geoms, dxGeom* geom, bool cull_planes, int threads, Buffer<dxGeom*>& hits);

  // Storage for hits, kept between queries. One that is taken by a query is free for no other.
  Buffer<dxGeom*> takeHits() { return std::move(hits_); }
  void giveBack(Buffer<dxGeom*>&& hits) { hits_ = std::move(hits); }

  // A frame went by: what no query asked for in many of them is given back.
  void noteFrame() {
    if (tree_ && ++idle_frames_ == idle_frames) release();
  }

  // Gives back all that is held.
  void release();
  std::size_t bytes() const;

 private:
  struct Tree;

  void note(std::size_t slot);
  bool bringUpToDate(const Geoms& geoms, int threads);

  std::unique_ptr<Tree> tree_;
  Buffer<dxGeom*> hits_;
  int idle_frames_ = 0;
  bool asked_ = false;       // there was a query
  double changes_ = 0;       // since the last query
  double queries_ = 0;       // since a great part of the geoms changed
  double last_queries_ = 0;  // between the two great changes before
  double stray_rows_ = 0;    // gone through by all queries since the tree was built
};

}  // namespace ode_parallel_sap

#endif
