#include "space/queries/geom_queries.h"

#include <algorithm>

#include "space/base/tuning.h"
#include "space/geoms/geom_prefetch.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

using Geoms = GeomTree::Geoms;

// Few hits are sorted. Many are marked in a set, which is in order.
void findByTree(const GeomTree& tree, const Geoms& geoms, const dxGeom* geom, QueryLists& lists) {
  Buffer<dxGeom*>& hits = lists.hits;
  Buffer<Slot>& found = lists.found;
  tree.find(geoms, geom, found);
  hits.resizeDiscarding(found.size());
  dxGeom** next = hits.data();
  const auto add = [&](Slot slot) {
    dxGeom* const own = geoms[slot];
    prefetchState(own);
    *next++ = own;
  };
  if (found.size() < geoms.size() / many_hits + few_hits) {
    std::sort(found.begin(), found.end());
    std::for_each(found.begin(), found.end(), add);
    return;
  }
  lists.marks.growTo(geoms.size());
  for (const Slot slot : found) lists.marks.insert(slot);
  lists.marks.forEach(add);
  lists.marks.clear();
}

void findByTests(const Geoms& geoms, const dxGeom* geom, Buffer<dxGeom*>& hits) {
  hits.resizeDiscarding(0);
  for (std::size_t slot = 0; slot < geoms.size(); ++slot) {
    if (slot + prefetch_distance < geoms.size())
      if (const dxGeom* const later = geoms[slot + prefetch_distance]) {
        prefetchState(later);
        prefetchBounds(later);
      }
    dxGeom* const own = geoms[slot];
    if (own && boxesOverlap(own, geom)) hits.push_back(own);
  }
}

}  // namespace

void findHits(const GeomTree* tree, const Geoms& geoms, dxGeom* geom, const PackRules& rules,
              QueryLists& lists) {
  if (tree)
    findByTree(*tree, geoms, geom, lists);
  else
    findByTests(geoms, geom, lists.hits);
  Buffer<dxGeom*>& hits = lists.hits;
  std::size_t found = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (i + prefetch_distance < hits.size()) prefetchState(hits[i + prefetch_distance]);
    dxGeom* const own = hits[i];
    hits[found] = own;
    found += isHit(own, geom, rules);
  }
  hits.resize(found);
}

}  // namespace ode_parallel_sap
