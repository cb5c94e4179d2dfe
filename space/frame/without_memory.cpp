#include "space/frame/without_memory.h"

#include "space/geom/plane_test.h"

namespace ode_parallel_sap {

namespace {

bool takesPart(const dxGeom* geom) {
  return isEnabled(geom) && !hasNaN(geom);
}

// By bounds, bits and bodies.
bool pairsExactly(dxGeom* a, dxGeom* b, const PackRules& rules) {
  const ScopedMode mode(exactMode());
  return boxesOverlap(a, b) && filtersMatch(a, b) && !(rules.cull_planes && areClearByPlane(a, b));
}

}  // namespace

void updateWithoutMemory(const Scene& scene, FrameResult& result) {
  const std::size_t geoms = result.geoms;
  result = FrameResult();
  result.geoms = geoms;
  result.found.method = dParallelSAPMethodBruteForce;
  result.moved = cleanOneByOne(scene.first);
  scene.needs_clean = false;
  for (const dxGeom* geom = scene.first; geom; geom = geom->next) {
    const bool invalid = isEnabled(geom) && hasNaN(geom);
    result.disabled += !isEnabled(geom);
    result.invalid += invalid;
    result.unbounded += isEnabled(geom) && !invalid && isUnbounded(geom);
  }
}

void collideWithoutMemory(const Scene& scene, const PackRules& rules, FrameResult& result,
                          void* data, dNearCallback* callback) {
  for (dxGeom* a = scene.first; a; a = a->next) {
    if (!takesPart(a)) continue;
    for (dxGeom* b = a->next; b; b = b->next) {
      if (!takesPart(b) || !pairsExactly(a, b, rules) || isLeftOut(a, b, rules)) continue;
      ++result.candidates;
      if (!passesAABBTests(a, b)) continue;
      ++result.pairs;
      callback(data, a, b);
    }
  }
}

void queryWithoutMemory(const Scene& scene, const PackRules& rules, dxGeom* geom, void* data,
                        dNearCallback* callback) {
  for (dxGeom* own = scene.first; own; own = own->next)
    if (takesPart(own) && pairsExactly(own, geom, rules) && passesAABBTests(own, geom))
      callback(data, own, geom);
}

}  // namespace ode_parallel_sap
