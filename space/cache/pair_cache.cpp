#include "space/cache/pair_cache.h"

#include <algorithm>
#include <utility>

#include "space/base/mechanisms.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

void PairCache::beginFrame(bool nested) {
  if (!complete_ || nested) running_ = false;
  complete_ = false;
}

void PairCache::start(std::size_t slots, bool in_trees) {
  running_ = true;
  all_may_have_changed_ = false;
  changed_.growTo(slots);
  in_trees_ = in_trees;
  trees_started_ = false;
}

// Small scenes are found anew faster than changes in trees that would have to be built.
bool PairCache::tooMany(std::size_t changes, std::size_t slots) const {
  const bool may_build = mechanisms::incremental_trees && (in_trees_ || slots > small_scene_slots);
  return changes * changing_share > slots || (changes > 0 && !may_build);
}

PairCache::Update PairCache::update(dxGeom* const* geoms, std::size_t slots, const PackRules& rules,
                                    int threads, GeomUpdate& geom_update) {
  Update update;
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
  update.threads = geom_update.notice(geoms, slots, threads, all, changed_);
  // Slots of removed geoms count as well: they have no box any more, but pairs to be dropped.
  update.changes = changed_.count();
  if (tooMany(update.changes, slots)) return update;
  update.kept = geom_update.repack(geoms, slots, threads, changed_);
  if (!update.kept) update.moved_in_vain = geom_update.facts().moved;
  return update;
}

template <class Real>
int PairCache::findChanged(ProxyTrees<Real>& trees, Sweep<Real>& base, const Buffer<Slot>& changed,
                           const BoxSet& boxes, int threads) {
  if (!trees_started_) {
    if (!in_trees_) {
      Buffer<std::uint64_t> workspace;
      base.build(boxes, threads, workspace);
    }
    trees.start(base, changed_.words() * SlotSet::word_slots, boxes);
    trees_started_ = true;
  }
  return trees.find(boxes, changed, threads, found_);
}

PairCache::Counts PairCache::renew(dxGeom* const* geoms, const Update& update,
                                   const GeomUpdate& geom_update, int threads, CPUFinders& finders,
                                   PairFilter& filter, PairList& pairs) {
  Counts counts = {update.threads, 0, pairs.size()};
  if (update.changes == 0) return counts;
  const BoxSet& boxes = geom_update.boxes();
  const Buffer<Slot>& changed = geom_update.repacked();
  const int used = boxes.wide
                       ? findChanged(wide_trees_, finders.wide.sweep, changed, boxes, threads)
                       : findChanged(trees_, finders.narrow.sweep, changed, boxes, threads);
  counts.threads = std::max(counts.threads, used);
  counts.found = found_.size();
  filter.dropExcluded(geoms, geom_update.facts(), rules_, boxes, threads, found_);
  counts.kept = merge_.replace(changed_, found_, threads, pairs);
  forgetChanges();
  return counts;
}

}  // namespace ode_parallel_sap
