#include "space/frame/without_memory.h"

#include "space/geom/pair_rule.h"

namespace ode_parallel_sap {

namespace {

// The AABBTest functions apart.
bool isPair(const PairRule& rule, dxGeom* a, dxGeom* b) {
  const ScopedMode mode(exactMode());
  return PairRule::takesPart(a) && rule.isPair(a, b);
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
  const PairRule rule(rules);
  for (dxGeom* a = scene.first; a; a = a->next) {
    if (!PairRule::takesPart(a)) continue;
    for (dxGeom* b = a->next; b; b = b->next) {
      if (!isPair(rule, b, a)) continue;
      ++result.candidates;
      if (!passesAABBTests(a, b)) continue;
      ++result.pairs;
      callback(data, a, b);
    }
  }
}

void queryWithoutMemory(const Scene& scene, const PackRules& rules, dxGeom* geom, void* data,
                        dNearCallback* callback) {
  const PackRules asked = rules.ofQueries();
  const PairRule rule(asked);
  for (dxGeom* own = scene.first; own; own = own->next)
    if (isPair(rule, own, geom) && passesAABBTests(own, geom)) callback(data, own, geom);
}

}  // namespace ode_parallel_sap
