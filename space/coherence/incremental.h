// Frames in which few boxes change: only their pairs are found anew.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "space/data/box_set.h"
#include "space/data/buffer.h"
#include "space/data/pair_list.h"
#include "space/data/slot_set.h"
#include "space/extract/sweep.h"
#include "space/sort/pair_order.h"

namespace ode_parallel_sap {

// All boxes stay in trees from frame to frame: the largest one is left behind by a sweep, what
// changed since is in levels of smaller ones, each several times smaller than the one before, which
// are made one when they come near each other in size (a log-structured merge). A box that changes
// moves to a new level; its old place is not looked for, but what is found there no longer counts,
// since each slot knows its level. A frame costs in proportion to what changed, and its share of
// the merging.
template <class Real>
class Incremental {
 public:
  // Goes on from `base`, which holds all of `boxes` that the next call does not name as changed,
  // and no slot from `base_slots` on. It is left alone by others from now on.
  void start(Sweep<Real>& base, std::size_t base_slots, const BoxSet& boxes);
  // `changed`, ascending, are the slots below boxes.size whose boxes or filters differ from those
  // of the call before, and all slots that are new. Leaves in
  // `found`, ascending, every overlapping pair that one of them takes part in, as
  // PairFinder::find would. Returns the number of threads used.
  int find(const BoxSet& boxes, const Buffer<Slot>& changed, int threads, PairList& found);
  std::size_t bytes() const {
    return bytesOf(tree_of_slot_, levels_, spare_levels_, gathered_, tasks_, found_, own_pairs_,
                   pair_order_);
  }

 private:
  struct Level {
    Sweep<Real> sweep;
    Buffer<Slot> slots;    // that came in, ascending
    std::size_t live = 0;  // those that are still here

    std::size_t bytes() const { return bytesOf(sweep, slots); }
  };
  struct Task {
    std::size_t queries, begin, end;  // a tree of the newest level, and cells of it
  };
  using TreeNumber = std::uint8_t;  // 0: the base; i: levels_[i - 1]

  void leaveTrees(const BoxSet& boxes, const Buffer<Slot>& changed);
  void gather(const BoxSet& boxes, const Buffer<Slot>& slots);
  int meetLevel(const Sweep<Real>& newest, const Sweep<Real>& level, TreeNumber tree, bool exact,
                int threads);
  void settle(const BoxSet& boxes, std::unique_ptr<Level> newest, int threads);
  void startBase(const BoxSet& boxes);
  std::unique_ptr<Level> newLevel();

  Sweep<Real>* base_ = nullptr;
  std::size_t base_live_ = 0;                   // boxes that are still in the base
  Buffer<TreeNumber> tree_of_slot_;             // by slot
  std::vector<std::unique_ptr<Level>> levels_;  // large ones first
  std::vector<std::unique_ptr<Level>> spare_levels_;
  BoxSet gathered_;  // the boxes of the newest level, one after the other
  std::vector<Task> tasks_;
  std::vector<Buffer<Pair>> found_;  // one a thread
  PairList own_pairs_;               // within the newest level
  PairOrder pair_order_;
};

}  // namespace ode_parallel_sap
