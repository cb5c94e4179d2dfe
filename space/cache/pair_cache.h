// The pairs of the last frame, made those of this one. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/cache/pair_merge.h"
#include "space/cache/proxy_trees.h"
#include "space/data/back_off.h"
#include "space/data/box_set.h"
#include "space/data/buffer.h"
#include "space/data/platform.h"
#include "space/data/slot_set.h"
#include "space/extract/cpu_finders.h"
#include "space/filter/pair_filter.h"
#include "space/update/geom_update.h"

namespace ode_parallel_sap {

// A proxy is a box with a margin. While boxes stay in their proxies, the pairs that overlap are
// among the candidates, the pairs of proxies. Candidates are kept in their order; those of proxies
// that are out of date are found anew in trees and merged in.
//
//   margin   if                                      out of date           of candidates, pairs are
//   0        at most one geom in changing_share      geoms that changed    all
//            changed
//   a share  all geoms move by little, which a       boxes that left       those whose boxes overlap
//   of size  sample of the boxes shows               their fat box
//
// Other frames are found anew by a PairFinder. The pairs are the same in either way.
class PairCache {
 public:
  // The geom of a slot is new, gone or has moved.
  void note(Slot slot) {
    if (!running_) return;
    changed_.growTo(slot + std::size_t{1});
    changed_.insert(slot);
    any_changed_ = true;
  }
  // Its geom has other bits, another body, or is enabled or disabled. From many threads at once.
  void noteShared(Slot slot) {
    if (!running_) return;
    changed_.insertShared(slot);
    storeShared(any_changed_, true);
  }
  // Any of the geoms may be such a one.
  void noteAll() { all_may_have_changed_ = true; }
  // The slots that changed since the last frame; null where that is not known.
  const SlotSet* changed() const { return complete_ && running_ ? &changed_ : nullptr; }
  // All boxes were packed.
  void forgetChanges() {
    changed_.clear();
    any_changed_ = false;
  }

  // Frames within a callback use the boxes, too, and one that throws leaves them as they are: then
  // nothing is kept.
  void beginFrame(bool nested);
  void endFrame() { complete_ = true; }
  // The pairs of a frame that was found anew are complete. `on_device`: devices found them.
  // `in_trees`: the sweep's trees hold its boxes.
  void start(std::size_t slots, bool on_device, bool in_trees);
  void stop() { running_ = false; }

  // Margin 0.
  struct Update {
    bool kept = false;              // boxes and pairs of the last frame serve
    std::size_t changes = 0;        // slots, if so
    int threads = 1;                // used
    std::size_t moved_in_vain = 0;  // geoms brought up to date, if not
    GeomUpdate::Untold untold;      // changes against dParallelSAPSpaceSetNotified's promise

    bool isSame() const { return kept && changes == 0; }
  };
  // Brings the boxes up to date with the changes, unless the frame is to be found anew.
  Update update(dxGeom* const* geoms, std::size_t slots, const PackRules& rules, int threads,
                GeomUpdate& geom_update, BoxSet& boxes);
  // Whether the last update() had nothing to look at, and another one would have nothing either.
  bool wouldRepeat(const GeomUpdate& geom_update) const {
    return running_ && was_plainly_same_ && isPlainlySame(rules_, geom_update);
  }
  struct Counts {
    int threads = 1;
    std::size_t found = 0, kept = 0;  // pairs
  };
  // After an update() that kept: makes `pairs` those of this frame. `finders` found them first.
  Counts renew(dxGeom* const* geoms, const Update& update, const GeomUpdate& geom_update,
               const BoxSet& boxes, int threads, CPUFinders& finders, PairFilter& filter,
               PairList& pairs);

  // A margin.
  enum class Fat {
    off,      // boxes move so far that they would not stay in fat ones
    started,  // all get fat boxes
    served,   // candidates are kept
    in_vain   // too many left their fat boxes in the first frame after they got them
  };
  // Whether findFat() should find the pairs of these boxes, which are floats: if candidates are
  // kept, or kept from now on. Sees from one call to the next how far boxes move.
  bool usesFat(const BoxSet& boxes, int threads, const Sweep<float>& sweep);
  // Likewise, whatever came of it before.
  Fat judgeFat(const BoxSet& boxes, int threads, const Sweep<float>& sweep);
  // Finds their pairs as PairFinder::find does. The sweep's trees are those of fat boxes then.
  Counts findFat(const BoxSet& boxes, int threads, Sweep<float>& sweep, PairList& pairs);
  // A frame did without. After many in a row nothing is held for fat boxes.
  void skipFat();

  void release() { *this = PairCache(); }
  std::size_t bytes() const {
    return bytesOf(changed_, trees_, wide_trees_, found_, merge_, fat_, candidates_, left_, leaving_,
                   sample_, borderline_);
  }

 private:
  // Who left the pairs of the last frame, and with them what renew() can go on from.
  enum class Source { trees, no_trees, device };
  enum class Proxies { none, boxes, fat };

  bool isPlainlySame(const PackRules& rules, const GeomUpdate& geom_update) const;
  bool tooMany(std::size_t changes, std::size_t slots) const;
  template <class Real>
  int findChanged(ProxyTrees<Real>& trees, Sweep<Real>& base, const Buffer<Slot>& changed,
                  const BoxSet& boxes, int threads);
  bool isSlow(const BoxSet& boxes);
  bool filtersChanged(const BoxSet& boxes, Slot slot) const;
  void listLeft(const BoxSet& boxes, int threads);
  void fatten(const BoxSet& boxes, Slot slot, float share);
  int startFat(const BoxSet& boxes, int threads, Sweep<float>& sweep);
  int followFat(const BoxSet& boxes, int threads, Sweep<float>& sweep, Counts& counts);
  int test(const BoxSet& boxes, int threads, PairList& pairs);
  void stopFat();

  SlotSet changed_;
  bool any_changed_ = false;  // if not, changed_ is empty
  bool all_may_have_changed_ = false;
  bool complete_ = false;  // the last frame came to its report
  bool running_ = false;   // its boxes and pairs are known
  bool was_plainly_same_ = false;  // at the last update()
  PackRules rules_;                // of the last update()
  Source source_ = Source::no_trees;
  Proxies in_trees_ = Proxies::none;
  ProxyTrees<float> trees_;
  ProxyTrees<double> wide_trees_;
  PairList found_;
  PairMerge merge_;

  bool fat_running_ = false;
  BackOff fat_back_off_{4};  // fat boxes that are left at once cost half a frame
  int fat_frames_ = 0;       // since all got fat boxes
  int fat_skipped_ = 0;      // frames since the last judgeFat()
  std::uint64_t builds_ = 0;  // of the sweep, when its trees were last those of fat boxes
  BoxSet fat_;
  PairList candidates_;
  SlotSet left_;          // slots whose fat boxes or filters hold no more, and those that are gone
  Buffer<Slot> leaving_;  // those of them that are still there, ascending
  Buffer<Box> sample_;    // some boxes of the last frame
  std::size_t sampled_ = 0;                                 // of so many slots; 0: none
  std::vector<std::vector<PairList::Segment>> borderline_;  // one a thread
};

}  // namespace ode_parallel_sap
