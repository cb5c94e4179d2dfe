#include "space/queries/geom_queries.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "space/data/tuning.h"
#include "space/geom/geom_prefetch.h"
#include "space/geom/geom_tests.h"
#include "space/geom/plane_test.h"

namespace ode_parallel_sap {

namespace {

void prefetch(const dxGeom* geom) {
  prefetchState(geom);
  prefetchBounds(geom);
}

// Whether geoms pair whose AABBs overlap. Needs exactMode().
bool pairs(const dxGeom* own, const dxGeom* geom) {
  return isEnabled(own) && filtersMatch(own, geom);
}

}  // namespace

void GeomQueries::release() {
  tree_.release();
  ahead_.release();
  found_.release();
}

void GeomQueries::find(const Geoms& geoms, dxGeom* geom, const Way& way, Buffer<dxGeom*>& hits) {
  bool has_tree;
  {
    const ScopedMode mode(exactMode());
    has_tree = tree_.bringUpToDate(geoms, way.threads);
  }
  looked_ahead_.queries = 0;
  if (has_tree && way.ahead && way.foreseen && ahead_.isDue(geom))
    lookAhead(geoms, geom, way.ahead);
  const ScopedMode mode(exactMode());
  QueriesAhead::Answer known;
  if (has_tree && ahead_.take(geom, known)) {
    hits.resizeDiscarding(known.end - known.begin);
    std::copy(known.begin, known.end, hits.data());
  } else if (has_tree) {
    findByTree(geoms, geom, hits);
  } else {
    findByTests(geoms, geom, hits);
  }
  std::size_t found = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (i + prefetch_distance < hits.size()) prefetchState(hits[i + prefetch_distance]);
    dxGeom* const own = hits[i];
    hits[found] = own;
    found += pairs(own, geom) && !(way.cull_planes && areClearByPlane(own, geom));
  }
  hits.resize(found);
}

void GeomQueries::lookAhead(const Geoms& geoms, dxGeom* geom, int threads) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  const QueriesAhead::Found found = ahead_.find(geoms, tree_, geom, threads);
  looked_ahead_.queries = found.queries;
  looked_ahead_.threads = found.threads;
  looked_ahead_.ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void GeomQueries::findByTree(const Geoms& geoms, const dxGeom* geom, Buffer<dxGeom*>& hits) {
  tree_.find(geoms, geom, found_.list());
  hits.resizeDiscarding(found_.list().size());
  dxGeom** next = hits.data();
  found_.forEachInOrder(geoms.size(), [&](Slot slot) {
    dxGeom* const own = geoms[slot];
    prefetchState(own);
    *next++ = own;
  });
}

void GeomQueries::findByTests(const Geoms& geoms, const dxGeom* geom, Buffer<dxGeom*>& hits) {
  hits.resizeDiscarding(0);
  for (std::size_t slot = 0; slot < geoms.size(); ++slot) {
    if (slot + prefetch_distance < geoms.size())
      if (const dxGeom* const later = geoms[slot + prefetch_distance]) prefetch(later);
    dxGeom* const own = geoms[slot];
    if (own && boxesOverlap(own, geom)) hits.push_back(own);
  }
}

}  // namespace ode_parallel_sap
