#include "space/frame/without_memory.h"

#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

// The AABBTest functions apart.
bool isPair(const PairRule& rule, dxGeom* a, dxGeom* b) {
  const ScopedMode mode(exactMode());
  return PairRule::takesPart(a) && rule.isPair(a, b);
}

}  // namespace

dParallelSAPStats updateWithoutMemory(const Scene& scene) {
  FrameCounts counts;
  counts.geoms = static_cast<unsigned>(scene.count);
  counts.moved = static_cast<unsigned>(cleanOneByOne(scene.first));
  scene.noteClean();
  for (const dxGeom* geom = scene.first; geom; geom = geom->next) {
    const bool invalid = isEnabled(geom) && hasNaN(geom);
    counts.disabled += !isEnabled(geom);
    counts.invalid += invalid;
    counts.unbounded += isEnabled(geom) && !invalid && isUnbounded(geom);
  }
  return statsOf(counts);
}

void collideWithoutMemory(const Scene& scene, const PackRules& rules, dParallelSAPStats& stats,
                          const PairReceiver& receiver) {
  const PairRule rule(rules);
  for (dxGeom* a = scene.first; a; a = a->next) {
    // Asked before each pair: the callback may disable it.
    for (dxGeom* b = a->next; b && PairRule::takesPart(a); b = b->next) {
      if (!isPair(rule, b, a)) continue;
      ++stats.candidates;
      if (!passesAABBTests(a, b)) continue;
      ++stats.pairs;
      receiver.callback(receiver.data, a, b);
    }
  }
  if (receiver.end) receiver.end(receiver.data);
}

void queryWithoutMemory(const Scene& scene, const PackRules& rules, dxGeom* geom, void* data,
                        dNearCallback* callback) {
  const PackRules of_queries = rules.ofQueries();
  const PairRule rule(of_queries);
  for (dxGeom* own = scene.first; own; own = own->next)
    if (isPair(rule, own, geom) && passesAABBTests(own, geom)) callback(data, own, geom);
}

}  // namespace ode_parallel_sap
