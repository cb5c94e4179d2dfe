#include "space/frame/without_memory.h"

#include <algorithm>

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
  counts.moved = cleanOneByOne(scene.first).moved;
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
  const Reports::Open open(scene.reports, receiver.opens);
  const Buffer<dxGeom*>& geoms = scene.slots;
  const std::size_t count = geoms.size();
  for (std::size_t i = 0; i < count; ++i) {
    // Asked before each pair: the callback may disable or destroy them.
    for (std::size_t j = i + 1; j < count && geoms[i] && PairRule::takesPart(geoms[i]); ++j) {
      dxGeom *const a = geoms[i], *const b = geoms[j];
      if (!b || !isPair(rule, b, a)) continue;
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
  PackRules of_queries;
  of_queries.cull_planes = rules.cull_planes;
  const PairRule rule(of_queries);
  const Reports::Open open(scene.reports);
  const Buffer<dxGeom*>& geoms = scene.slots;
  const std::size_t count = geoms.size();
  const auto probe =
      static_cast<std::size_t>(std::find(geoms.begin(), geoms.end(), geom) - geoms.begin());
  for (std::size_t slot = 0; slot < count && (probe == count || geoms[probe] == geom); ++slot)
    if (dxGeom* const own = geoms[slot])
      if (isPair(rule, own, geom) && passesAABBTests(own, geom)) callback(data, own, geom);
}

}  // namespace ode_parallel_sap
