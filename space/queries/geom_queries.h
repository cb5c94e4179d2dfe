// Which geoms of a space another geom's AABB overlaps: dSpaceCollide2. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "space/base/buffer.h"
#include "space/base/floating_point.h"
#include "space/base/slot_set.h"
#include "space/geoms/pair_rule.h"
#include "space/queries/geom_tree.h"

namespace ode_parallel_sap {

// What a query found, in storage that is kept between queries, so that none of them allocates.
struct QueryLists {
  Buffer<dxGeom*> hits;
  Buffer<Slot> found;       // in the end those of the hits
  std::optional<Slot> own;  // of the geom of the query, if it is in the space
  SlotSet marks;            // empty between queries

  std::size_t bytes() const { return bytesOf(hits, found, marks); }
};

// Walks a GeomTree where queries come often enough to pay for it; tests geom by geom where they do
// not.
class GeomQueries {
 public:
  using Geoms = Buffer<dxGeom*>;  // by slot, null where there is none
  // The most threads that build a tree; or a guest, which changes nothing but its lists.
  static constexpr int guest = 0;

  void changed(std::size_t slot) { tree_.changed(slot); }
  void reset() { tree_.reset(); }
  // As of the tree.
  bool clean(const Geoms& geoms) { return tree_.clean(geoms); }

  // Are tested in one pass, without lists or a tree.
  static constexpr std::size_t few_geoms = 16;
  // The slots of so few that are pairs with `geom`, as find() finds them: a bit each.
  static std::uint32_t findFew(const Geoms& geoms, dxGeom* geom, const PackRules& rules) {
    const ScopedMode mode(exactMode());
    std::uint32_t hits = 0, bit = 1;
    for (dxGeom* const own : geoms) {
      if (own && boxesOverlap(own, geom) && isEnabled(own) && filtersMatch(own, geom) &&
          !(rules.cull_planes && areClearByPlane(own, geom)))
        hits |= bit;
      bit <<= 1;
    }
    return hits;
  }

  // Puts into the hits, in ascending order of their slots, the enabled geoms that are pairs with
  // `geom` by the rules of queries, the AABBTest calls apart. All AABBs are up to date, that of
  // `geom` is without NaN. Throws std::bad_alloc where memory ends.
  void find(const Geoms& geoms, dxGeom* geom, const PackRules& rules, int threads,
            QueryLists& lists) {
    const ScopedMode mode(exactMode());
    if (threads == guest)
      findBy(read().mayRead(), geoms, geom, rules, lists);
    else
      findBy(tree_.bringUpToDate(geoms, threads), geoms, geom, rules, lists);
  }

  // For a batch: whether so many queries more go by the tree, which a guest reads meanwhile.
  bool prepare(const Geoms& geoms, int threads, std::size_t queries) {
    const ScopedMode mode(exactMode());
    return tree_.bringUpToDate(geoms, threads, static_cast<double>(queries));
  }
  GeomTree::Reader read() const { return GeomTree::Reader(tree_); }
  // One of them, as find(). Needs exactMode(); may run on many threads at once.
  void findBy(bool tree, const Geoms& geoms, dxGeom* geom, const PackRules& rules,
              QueryLists& lists) const;

  // Whether it gave back what it holds.
  bool noteFrame() { return tree_.noteFrame(); }

  // Gives back all that is held.
  void release() { tree_.release(); }
  std::size_t bytes() const { return bytesOf(tree_); }

 private:
  void findByTree(const Geoms& geoms, const dxGeom* geom, QueryLists& lists) const;
  static void findByTests(const Geoms& geoms, const dxGeom* geom, Buffer<dxGeom*>& hits);

  GeomTree tree_;
};

}  // namespace ode_parallel_sap
