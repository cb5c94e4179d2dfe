#include "space/coherence/pair_keeper.h"

#include <algorithm>
#include <utility>

#include "space/coherence/tuning.h"
#include "space/data/mechanisms.h"
#include "space/data/tuning.h"

namespace ode_parallel_sap {

void PairKeeper::start(std::size_t slots, bool on_device, bool in_trees) {
  running_ = true;
  all_may_have_changed_ = false;
  changed_.growTo(slots);
  source_ = on_device ? Source::device : in_trees ? Source::trees : Source::no_trees;
  incremental_started_ = false;
}

// Scenes as small as that are found anew faster than changes in a tree.
bool PairKeeper::mayBuildTrees(std::size_t slots) const {
  return mechanisms::incremental_trees && (source_ != Source::no_trees || slots > smallest_scene);
}

bool PairKeeper::tooMany(std::size_t changes, std::size_t slots) const {
  return changes * changing_share > slots || (changes > 0 && !mayBuildTrees(slots));
}

PairKeeper::Outcome PairKeeper::update(dxGeom* const* geoms, std::size_t slots,
                                       const PackRules& rules, int threads, GeomUpdate& geom_update,
                                       BoxSet& boxes) {
  moved_in_vain_ = 0;
  untold_ = GeomUpdate::Untold();
  was_plainly_same_ = false;
  if (!running_ || rules != rules_ || !geom_update.canRepack()) {
    rules_ = rules;
    return Outcome::not_tried;
  }
  if (isPlainlySame(rules, geom_update)) {
    was_plainly_same_ = true;
    geom_update.keepAll();
    changes_ = 0;
    threads_ = 1;
    return Outcome::kept;
  }
  // Within a tolerance most of what moved may turn out to stay.
  const bool some_may_stay = rules.tolerance > 0;
  if (!some_may_stay && tooMany(changed_.count(), slots)) return Outcome::anew;
  changed_.growTo(slots);
  bool all = std::exchange(all_may_have_changed_, false);
  if (rules.notified && rules.checked && !all) {
    untold_ = geom_update.findUntold(geoms, boxes, changed_);
    all = untold_.count > 0;
  }
  threads_ = geom_update.notice(geoms, slots, threads, boxes, all, changed_);
  const std::size_t changes = changed_.count();
  if (!some_may_stay && tooMany(changes, slots)) return Outcome::anew;
  const bool fits =
      geom_update.repack(geoms, slots, slots / changing_share, threads, changed_, boxes);
  // Slots that are gone are in none of the boxes, but in pairs.
  changes_ = some_may_stay ? changed_.count() : changes;
  if (fits && !tooMany(changes_, slots)) {
    any_changed_ = changes_ > 0;
    return Outcome::kept;
  }
  moved_in_vain_ = geom_update.facts().moved;
  return Outcome::anew;
}

template <class Real>
int PairKeeper::findChanged(Incremental<Real>& incremental, Sweep<Real>& base,
                            const GeomUpdate& geom_update, const BoxSet& boxes, int threads) {
  if (!incremental_started_) {
    if (source_ != Source::trees) base.build(boxes, threads);
    incremental.start(base, changed_.words() * SlotSet::word_slots, boxes);
    incremental_started_ = true;
  }
  return incremental.find(boxes, geom_update.repacked(), threads, found_);
}

int PairKeeper::find(dxGeom* const* geoms, const GeomUpdate& geom_update, const BoxSet& boxes,
                     int threads, const Lent& lent, PairList& pairs) {
  candidates_ = 0;
  int used = threads_;
  if (changes_) {
    used = std::max(used, boxes.wide ? findChanged(wide_incremental_, lent.finders.wide.sweep,
                                                   geom_update, boxes, threads)
                                     : findChanged(incremental_, lent.finders.narrow.sweep,
                                                   geom_update, boxes, threads));
    candidates_ = found_.size();
    lent.filter.run(geoms, geom_update.facts(), rules_, boxes, threads, found_);
    kept_pairs_.replace(changed_, found_, threads, pairs);
    kept_ = kept_pairs_.kept();
    forgetChanges();
  } else {
    kept_ = pairs.size();
  }
  return used;
}

}  // namespace ode_parallel_sap
