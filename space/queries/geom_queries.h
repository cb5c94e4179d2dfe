// Which geoms of a space another geom's AABB overlaps: dSpaceCollide2.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>

#include "space/base/buffer.h"
#include "space/base/slot_set.h"
#include "space/geoms/pair_rule.h"
#include "space/queries/geom_tree.h"

namespace ode_parallel_sap {

// The program's own word on which geoms, none of them spaces, the queries of a batch may meet.
struct QueryFilter {
  dParallelSAPQueryFilter* function = nullptr;
  void* data = nullptr;

  bool isSet() const { return function; }
  // In the program's mode.
  bool rejects(std::size_t query, dxGeom* geom) const { return function(data, query, geom) == 0; }
};

// What a query found, in storage that is kept between queries, so that none of them allocates.
struct QueryLists {
  Buffer<dxGeom*> hits;
  Buffer<Slot> found;  // in the end those of the hits
  SlotSet marks;       // empty between queries

  std::size_t bytes() const { return bytesOf(hits, found, marks); }
};

// Puts into the hits, in ascending order of their slots, the enabled geoms that are pairs with
// `geom` by the rules of queries, the AABBTest calls apart. All AABBs are up to date, that of
// `geom` is without NaN. By the tree, or without one geom by geom. Needs exactMode(); may run on
// many threads at once. Throws std::bad_alloc.
void findHits(const GeomTree* tree, const GeomTree::Geoms& geoms, dxGeom* geom,
              const PackRules& rules, QueryLists& lists);

// So few geoms are tested in one pass, without lists or a tree.
constexpr std::size_t few_geoms = 16;
// The slots of so few that are hits: a bit each.
inline std::uint32_t findFew(const GeomTree::Geoms& geoms, dxGeom* geom, const PackRules& rules) {
  const ScopedMode mode(exactMode());
  std::uint32_t hits = 0, bit = 1;
  for (dxGeom* const own : geoms) {
    if (own && boxesOverlap(own, geom) && isHit(own, geom, rules)) hits |= bit;
    bit <<= 1;
  }
  return hits;
}

}  // namespace ode_parallel_sap
