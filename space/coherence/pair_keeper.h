// Keeps boxes and pairs from frame to frame while little changes. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "space/coherence/incremental.h"
#include "space/coherence/kept_pairs.h"
#include "space/data/box_set.h"
#include "space/data/mechanisms.h"
#include "space/data/platform.h"
#include "space/data/slot_set.h"
#include "space/extract/cpu_finders.h"
#include "space/filter/pair_filter.h"
#include "space/update/geom_update.h"

namespace ode_parallel_sap {

// A space tells it which slots changed as ODE tells the space. A frame first tries update(): if
// that succeeds, find() makes the last frame's pairs this frame's. Otherwise the frame is found
// anew and start() begins again from it.
class PairKeeper {
 public:
  // Whether the last frame's boxes and pairs serve: nothing was kept, they do, too much changed.
  enum class Outcome { not_tried, kept, anew };

  // The geom of a slot is new, gone or has moved.
  void change(Slot slot) {
    if (!running_) return;
    changed_.growTo(slot + std::size_t{1});
    changed_.insert(slot);
    any_changed_ = true;
  }
  // Its geom has other bits or another body, or is enabled where it was not. May be called from
  // many threads at once.
  void tell(Slot slot) {
    if (!running_) return;
    changed_.insertShared(slot);
    storeShared(any_changed_, true);
  }
  // Any of the geoms may be such a one.
  void tellAll() { all_may_have_changed_ = true; }
  // The slots that changed since the last frame; null where that is not known.
  const SlotSet* changed() const { return running_ ? &changed_ : nullptr; }
  // The boxes are about to be packed as a whole.
  void forgetChanges() {
    changed_.clear();
    any_changed_ = false;
  }
  // The last frame's boxes and pairs are complete, or of no use any more. `in_trees`: these boxes
  // are those that the sweep's trees hold.
  void start(std::size_t slots, bool on_device, bool in_trees);
  void stop() { running_ = false; }

  // Brings the boxes up to date with what changed, unless the frame is to be found anew.
  Outcome update(dxGeom* const* geoms, std::size_t slots, const PackRules& rules, int threads,
                 GeomUpdate& geom_update, BoxSet& boxes);
  // Geoms that changed before the last update() although neither ODE nor the program told so.
  const GeomUpdate::Untold& untold() const { return untold_; }
  // Geoms that the last update() moved although the frame is to be found anew.
  std::size_t movedInVain() const { return moved_in_vain_; }
  struct Lent {
    CPUFinders& finders;  // with the sweep that found a frame's pairs, and its trees
    PairFilter& filter;
  };
  // Then makes `pairs` those of this frame. Returns the number of threads used for both.
  int find(dxGeom* const* geoms, const GeomUpdate& geom_update, const BoxSet& boxes, int threads,
           const Lent& lent, PairList& pairs);
  // Of the last find(): pairs that were looked at, and pairs that stayed.
  std::size_t candidates() const { return candidates_; }
  std::size_t kept() const { return kept_; }
  // Whether it left all pairs as they were.
  bool unchanged() const { return changes_ == 0; }
  // Whether the last update() had nothing to look at, and another one by the same rules would have
  // nothing to look at either.
  bool wouldRepeat(const GeomUpdate& geom_update) const {
    return running_ && was_plainly_same_ && isPlainlySame(rules_, geom_update);
  }
  std::size_t bytes() const {
    return bytesOf(changed_, incremental_, wide_incremental_, found_, kept_pairs_);
  }

 private:
  // Who left the pairs of the last frame, and with them what find() can go on from.
  enum class Source { trees, no_trees, device };

  // Sees without going through the slots that nothing was told of, and that there is nothing to
  // look at.
  bool isPlainlySame(const PackRules& rules, const GeomUpdate& geom_update) const {
    return mechanisms::plainly_same_frames && !any_changed_ && !all_may_have_changed_ &&
           !rules.checked && source_ != Source::device && geom_update.watchesNone();
  }
  bool mayBuildTrees(std::size_t slots) const;
  bool tooMany(std::size_t changes, std::size_t slots) const;
  template <class Real>
  int findChanged(Incremental<Real>& incremental, Sweep<Real>& base, const GeomUpdate& geom_update,
                  const BoxSet& boxes, int threads);

  SlotSet changed_;
  bool any_changed_ = false;  // if not, changed_ is empty
  bool running_ = false;
  bool all_may_have_changed_ = false;
  bool was_plainly_same_ = false;  // at the last update()
  GeomUpdate::Untold untold_;
  PackRules rules_;  // of the last frame, and of this one where its pairs are kept
  Source source_ = Source::no_trees;
  bool incremental_started_ = false;
  Incremental<float> incremental_;
  Incremental<double> wide_incremental_;
  PairList found_;
  KeptPairs kept_pairs_;
  int threads_ = 1;          // of the last update()
  std::size_t changes_ = 0;  // likewise: the slots in changed_
  std::size_t moved_in_vain_ = 0;
  std::size_t candidates_ = 0, kept_ = 0;
};

}  // namespace ode_parallel_sap
