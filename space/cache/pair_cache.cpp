#include "space/cache/pair_cache.h"

#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/mechanisms.h"
#include "space/base/tuning.h"
#include "space/geoms/pair_filter.h"

namespace ode_parallel_sap {

void PairCache::start(std::size_t slots) {
  changed_.growTo(slots);
  changed_.clear();
  running_ = true;
  all_may_have_changed_ = false;
}

// Small scenes are found anew faster than changes in a tree.
bool PairCache::tooMany(std::size_t changes, std::size_t slots) const {
  const bool by_tree = mechanisms::incremental_trees && slots > small_scene_slots;
  return changes * changed_share > slots || (changes > 0 && !by_tree);
}

PairCache::Update PairCache::update(dxGeom* const* geoms, std::size_t slots, const PackRules& rules,
                                    int threads, GeomUpdate& geom_update,
                                    dParallelSAPStats& stats) {
  Update update;
  if (!std::exchange(complete_, false)) running_ = false;
  const bool same_rules = rules == rules_;
  rules_ = rules;
  if (!running_ || !same_rules || !geom_update.canRepack()) return update;
  if (tooMany(changed_.count(), slots)) return update;
  changed_.growTo(slots);
  bool all = std::exchange(all_may_have_changed_, false);
  if (rules.notified && rules.checked && !all) {
    update.unannounced = geom_update.findUnannounced(geoms, changed_);
    all = update.unannounced.count > 0;
  }
  stats.find_threads = geom_update.notice(geoms, slots, threads, all, changed_);
  // Slots of removed geoms count as well: they have no box any more, but pairs to be dropped.
  update.changes = changed_.count();
  if (tooMany(update.changes, slots)) return update;
  update.kept = geom_update.repack(geoms, slots, threads, changed_);
  if (!update.kept) stats.moved += geom_update.facts().moved;
  return update;
}

bool PairCache::renew(const GeomTree::Geoms& geoms, const Update& update,
                      const GeomUpdate& geom_update, int threads, SharedPart<GeomTree>& part,
                      PairList& pairs, dParallelSAPStats& stats) {
  if (update.changes == 0) {
    stats.kept = pairs.size();
    return true;
  }
  const BoxSet& boxes = geom_update.boxes();
  const Buffer<Slot>& changed = geom_update.repacked();
  const UpdateFacts& facts = geom_update.facts();
  const ScopedMode mode(exactMode());
  GeomTree* const tree = part.made();
  if (!tree || !tree->bringUpToDate(geoms, threads, changed.size(), /*must=*/true)) return false;
  const PairFilter filter(geoms.data(), geom_update, rules_);
  const int used = changed_pairs_.find(
      boxes, facts.disabled == 0, changed, changed_, threads, &filter,
      [&](Slot slot, Buffer<Slot>& hits) { tree->find(geoms, geoms[slot], hits); });
  stats.find_threads = std::max(stats.find_threads, used);
  stats.candidates = changed_pairs_.found().size();
  stats.kept = changed_pairs_.replace(changed_, threads, pairs);
  changed_.clear();
  return true;
}

}  // namespace ode_parallel_sap
