// The pairs of the last frame, made those of this one.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/cache/changed_pairs.h"
#include "space/geoms/geom_update.h"
#include "space/queries/geom_tree.h"

namespace ode_parallel_sap {

// If at most one geom in changed_share changed, pairs of the others stay, and those of changed
// geoms are found in a tree and merged in. A frame that does not reach end() leaves nothing to
// keep: an exception or a longjmp may have left boxes and pairs in any state.
class PairCache {
 public:
  // The geom of a slot is new, gone or has moved.
  void note(Slot slot) {
    if (state_ == off) return;
    changed_.growTo(slot + std::size_t{1});
    changed_.insert(slot);
  }
  // Its geom has other bits, another body, or is enabled or disabled. From many threads at once.
  void noteShared(Slot slot) {
    if (state_ != off) changed_.insertShared(slot);
  }
  // Any of the geoms may be such a one.
  void noteAll() { all_may_have_changed_ = true; }
  // The slots that changed since the last frame; null where that is not known.
  const SlotSet* changed() const { return state_ == complete ? &changed_ : nullptr; }

  // What a frame keeps of the last one.
  struct Kept {
    bool any = false;          // its boxes, which are up to date, and its pairs, for renew()
    std::size_t changes = 0;   // slots
    GeomTree* tree = nullptr;  // up to date, if there are changes
    GeomUpdate::Unannounced unannounced;  // changes against dParallelSAPSpaceSetNotified's promise

    bool isSame() const { return any && changes == 0; }
  };
  // A frame begins. Decides what it keeps, and brings that up to date but for the pairs.
  Kept begin(bool may_keep, const GeomTree::Geoms& geoms, const PairRules& rules, int threads,
             SharedPart<GeomTree>& tree, GeomUpdate& geom_update, dParallelSAPStats& stats);
  // All boxes are up to date, and the next frame may keep them. Changes count from now on.
  void start(std::size_t slots);
  // Makes the last frame's `pairs` this one's; the test keeps new ones. Returns the threads used.
  int renew(const Kept& kept, const GeomTree::Geoms& geoms, const GeomUpdate& geom_update,
            const PairTest& test, int threads, PairList& pairs, dParallelSAPStats& stats);
  // The frame comes to its report.
  void end() {
    if (state_ != off) state_ = complete;
  }
  // Nothing is kept, and no change noted, until the next start().
  void stop() { state_ = off; }

  // Pairs are all that overlap and pass the filter, more with a tolerance, and no change is left.
  void validate(dxGeom* const* geoms, const GeomUpdate& update, const PairRules& rules,
                const PairList& pairs) const;
  std::size_t bytes() const { return bytesOf(changed_, changed_pairs_); }

 private:
  bool tooMany(std::size_t changes, std::size_t slots) const;
  bool keep(const GeomTree::Geoms& geoms, int threads, SharedPart<GeomTree>& tree,
            GeomUpdate& geom_update, dParallelSAPStats& stats, Kept& kept);

  enum State {
    off,         // nothing is known, and changes are not noted
    unfinished,  // a frame runs, or did not reach its end
    complete     // the last frame's boxes and pairs are known
  };

  State state_ = off;
  SlotSet changed_;
  bool all_may_have_changed_ = false;
  PairRules rules_;  // of the last frame
  ChangedPairs changed_pairs_;
};

}  // namespace ode_parallel_sap
