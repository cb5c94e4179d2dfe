// The pairs of the last frame, made those of this one.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <utility>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/cache/changed_pairs.h"
#include "space/geoms/geom_update.h"
#include "space/queries/geom_tree.h"

namespace ode_parallel_sap {

// If at most one geom in changed_share changed, pairs of the others stay, and those of changed
// geoms are found in a tree and merged in.
class PairCache {
 public:
  // The geom of a slot is new, gone or has moved.
  void note(Slot slot) {
    if (!running_) return;
    changed_.growTo(slot + std::size_t{1});
    changed_.insert(slot);
  }
  // Its geom has other bits, another body, or is enabled or disabled. From many threads at once.
  void noteShared(Slot slot) {
    if (!running_) return;
    changed_.insertShared(slot);
  }
  // Any of the geoms may be such a one.
  void noteAll() { all_may_have_changed_ = true; }
  // The slots that changed since the last frame; null where that is not known.
  const SlotSet* changed() const { return complete_ && running_ ? &changed_ : nullptr; }

  // The frame came to its report. One that throws leaves boxes and pairs as they are: then the next
  // one keeps nothing.
  void endFrame() { complete_ = true; }
  // The boxes and pairs of a frame that was found anew are complete. From stop() on no change
  // counted.
  void start(std::size_t slots);
  void stop() { running_ = false; }

  struct Update {
    bool kept = false;                    // boxes and pairs of the last frame serve
    std::size_t changes = 0;              // slots, if so
    GeomUpdate::Unannounced unannounced;  // changes against dParallelSAPSpaceSetNotified's promise

    bool isSame() const { return kept && changes == 0; }
  };
  // Brings the boxes up to date with the changes, unless the frame is to be found anew.
  Update update(dxGeom* const* geoms, std::size_t slots, const PackRules& rules, int threads,
                GeomUpdate& geom_update, dParallelSAPStats& stats);
  // Notes whether the frame reports all candidates. Returns whether its pairs are those of the last
  // frame.
  bool noteReported(bool all, const Update& update) {
    return std::exchange(reported_all_, all) && all && update.isSame();
  }
  // After an update() that kept: makes `pairs` those of this frame. False where others read the
  // tree, or there is none: the frame is to be found anew.
  bool renew(const GeomTree::Geoms& geoms, const Update& update, const GeomUpdate& geom_update,
             int threads, SharedPart<GeomTree>& part, PairList& pairs, dParallelSAPStats& stats);

  // Pairs are all that overlap and pass the filter, more with a tolerance, and no change is left.
  void validate(dxGeom* const* geoms, const GeomUpdate& update, const PackRules& rules,
                const PairList& pairs) const;
  std::size_t bytes() const { return bytesOf(changed_, changed_pairs_); }

 private:
  bool tooMany(std::size_t changes, std::size_t slots) const;

  SlotSet changed_;
  bool all_may_have_changed_ = false;
  bool complete_ = false;      // the last frame came to its report
  bool running_ = false;       // its boxes and pairs are known
  bool reported_all_ = false;  // of the candidates, in the last frame
  PackRules rules_;            // of the last update()
  ChangedPairs changed_pairs_;
};

}  // namespace ode_parallel_sap
