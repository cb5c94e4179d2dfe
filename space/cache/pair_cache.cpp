#include "space/cache/pair_cache.h"

#include <utility>

#include "space/base/floating_point.h"
#include "space/base/mechanisms.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

// Small scenes are found anew faster than changes in a tree.
bool PairCache::tooMany(std::size_t changes, std::size_t slots) const {
  const bool by_tree = mechanisms::incremental_trees && slots > small_scene_slots;
  return changes * changed_share > slots || (changes > 0 && !by_tree);
}

PairCache::Kept PairCache::begin(bool may_keep, const GeomTree::Geoms& geoms,
                                 const PairRules& rules, int threads, SharedPart<GeomTree>& tree,
                                 GeomUpdate& geom_update, dParallelSAPStats& stats) {
  Kept kept;
  const bool is_known = may_keep && state_ == complete && rules == rules_;
  rules_ = rules;
  state_ = unfinished;
  kept.any = is_known && keep(geoms, threads, tree, geom_update, stats, kept);
  if (!kept.any) state_ = off;
  return kept;
}

void PairCache::start(std::size_t slots) {
  changed_.growTo(slots);
  changed_.clear();
  all_may_have_changed_ = false;
  state_ = unfinished;
}

// False where that is not worth it, where other boxes are needed, or where others read the tree.
bool PairCache::keep(const GeomTree::Geoms& geoms, int threads, SharedPart<GeomTree>& tree,
                     GeomUpdate& geom_update, dParallelSAPStats& stats, Kept& kept) {
  const std::size_t slots = geoms.size();
  if (!geom_update.canRepack() || tooMany(changed_.count(), slots)) return false;
  changed_.growTo(slots);
  bool all = std::exchange(all_may_have_changed_, false);
  if (rules_.notified && rules_.checked && !all) {
    kept.unannounced = geom_update.findUnannounced(geoms.data(), changed_);
    all = kept.unannounced.count > 0;
  }
  stats.find_threads = geom_update.addSilent(geoms.data(), slots, threads, all, changed_);
  // Slots of removed geoms count as well: they have no box any more, but pairs to be dropped.
  kept.changes = changed_.count();
  if (tooMany(kept.changes, slots)) return false;
  const bool repacked = geom_update.repack(geoms.data(), slots, threads, changed_);
  stats.moved += geom_update.facts().moved;
  if (!repacked || kept.changes == 0) return repacked;
  kept.tree = tree.made();
  return kept.tree && kept.tree->bringUpToDate(geoms, threads, geom_update.repacked().size(),
                                               /*must=*/true);
}

int PairCache::renew(const Kept& kept, const GeomTree::Geoms& geoms, const GeomUpdate& geom_update,
                     const PairTest& test, int threads, PairList& pairs, dParallelSAPStats& stats) {
  if (kept.changes == 0) {
    stats.kept = pairs.size();
    return 1;
  }
  const ScopedMode mode(exactMode());
  const int used = changed_pairs_.find(
      geom_update.boxes(), geom_update.facts().disabled == 0, geom_update.repacked(), changed_,
      threads, &test,
      [&](Slot slot, Buffer<Slot>& hits) { kept.tree->find(geoms, geoms[slot], hits); });
  stats.candidates = changed_pairs_.found().size();
  stats.kept = changed_pairs_.replace(changed_, threads, pairs);
  changed_.clear();
  return used;
}

}  // namespace ode_parallel_sap
