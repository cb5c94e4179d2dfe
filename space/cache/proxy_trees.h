// Trees of boxes that stay from frame to frame: the pairs of few changed boxes are found in them.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/pairs/sweep.h"

namespace ode_parallel_sap {

// A sweep leaves a base, the trees of all boxes. A box that changes moves into a second, smaller
// set of trees, the recent ones. Its old place is not looked for: each slot knows its tree, and
// pairs that are found in another one do not count. When the recent boxes come near the base in
// number, the base is made anew.
template <class Real>
class ProxyTrees {
 public:
  // Goes on from `base`, which holds all of `boxes` that the next find() does not name as changed,
  // and no slot from `base_slots` on. Nobody else changes it from now on.
  void start(Sweep<Real>& base, std::size_t base_slots, const BoxSet& boxes);
  // `changed`, ascending, are the slots below boxes.size whose boxes or filters differ from those
  // of the call before, and all new slots. Leaves in `found`, ascending, every overlapping pair
  // that one of them is in, as PairFinder::find would. Returns the number of threads used.
  int find(const BoxSet& boxes, const Buffer<Slot>& changed, int threads, PairList& found);
  std::size_t bytes() const {
    return bytesOf(tree_of_slot_, newest_, recent_, gathered_, tasks_, found_, own_pairs_,
                   workspace_);
  }

 private:
  enum class Tree : std::uint8_t { base, recent, none };
  struct Trees {
    Sweep<Real> sweep;
    Buffer<Slot> slots;  // ascending

    std::size_t bytes() const { return bytesOf(sweep, slots); }
  };
  struct Task {
    std::size_t tree, begin, end;  // one of the newest trees, and cells of it
  };

  void startBase(const BoxSet& boxes);
  void leaveTrees(const BoxSet& boxes, const Buffer<Slot>& changed);
  void gather(const BoxSet& boxes, const Buffer<Slot>& slots);
  int meet(const Sweep<Real>& other, Tree tree, bool exact, int threads);
  void mergeNewest(const BoxSet& boxes, int threads);

  Sweep<Real>* base_ = nullptr;
  std::size_t base_boxes_ = 0, recent_boxes_ = 0;  // that are still there
  Buffer<Tree> tree_of_slot_;                      // by slot
  std::unique_ptr<Trees> newest_, recent_;
  BoxSet gathered_;  // the boxes of the newest trees, one after the other
  std::vector<Task> tasks_;
  std::vector<Buffer<Pair>> found_;  // one a thread
  PairList own_pairs_;               // among the newest
  Buffer<std::uint64_t> workspace_;  // to sort with
};

}  // namespace ode_parallel_sap
