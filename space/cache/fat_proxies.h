// Frames in which everything moves, but by little: the pairs of larger boxes are kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/back_off.h"
#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/base/slot_set.h"
#include "space/cache/pair_merge.h"
#include "space/cache/proxy_trees.h"
#include "space/pairs/sweep.h"

namespace ode_parallel_sap {

// Each box gets a fat one, a box with a margin. While boxes stay in their fat ones, the pairs that
// overlap are among the candidates, the pairs of fat boxes. A frame tests these and searches
// nothing. Boxes that leave get other fat ones, whose candidates are found anew.
//
// The pairs are those that PairFinder::find finds for the boxes of the frame, and follow from these
// boxes alone; but with a tolerance all candidates are pairs. While it runs it holds 36 bytes a
// slot and 8 a candidate.
class FatProxies {
 public:
  // Whether find() should find the pairs of these boxes, which are floats: they have moved little
  // since the last call, and fat boxes were not left in vain lately. `sweep` is the one that find()
  // gets. With a `tolerance` margins are a part of it, and all candidates are pairs.
  bool prepare(const BoxSet& boxes, double tolerance, int threads, const Sweep<float>& sweep);
  // A frame did without. After many in a row nothing is held.
  void noteUnused();
  // Finds the pairs of the boxes that prepare() saw, as PairFinder::find does. The sweep's trees
  // are those of fat boxes afterwards.
  int find(const BoxSet& boxes, int threads, Sweep<float>& sweep, PairList& pairs);

  // Candidates that the last find() did not find anew.
  std::size_t kept() const { return kept_; }
  std::size_t bytes() const {
    return bytesOf(fat_, candidates_, left_, leaving_, trees_, found_, merge_, sample_,
                   borderline_);
  }

 private:
  bool isSlow(const BoxSet& boxes);
  bool candidatesServe(const BoxSet& boxes, int threads, const Sweep<float>& sweep);
  bool filtersChanged(const BoxSet& boxes, Slot slot) const;
  void listLeft(const BoxSet& boxes, int threads);
  void fatten(const BoxSet& boxes, Slot slot, float share);
  int start(const BoxSet& boxes, int threads, Sweep<float>& sweep);
  int follow(const BoxSet& boxes, int threads, Sweep<float>& sweep);
  int test(const BoxSet& boxes, int threads, PairList& pairs);
  void stop();

  float tolerance_ = 0;
  bool running_ = false;
  BackOff back_off_{4};
  int frames_ = 0;            // since all got fat boxes
  int skipped_ = 0;           // frames since prepare() looked
  std::uint64_t builds_ = 0;  // of the sweep, when its trees were last those of fat boxes
  BoxSet fat_;
  PairList candidates_;
  SlotSet left_;          // slots whose fat boxes or filters hold no more, and those that are gone
  Buffer<Slot> leaving_;  // those of them that are still there, ascending
  ProxyTrees<float> trees_;
  bool trees_started_ = false;
  PairList found_;
  PairMerge merge_;
  std::size_t kept_ = 0;
  Buffer<Box> sample_;                                      // some boxes of the last frame
  std::size_t sampled_ = 0;                                 // of so many slots; 0: none
  std::vector<std::vector<PairList::Segment>> borderline_;  // one a thread
};

}  // namespace ode_parallel_sap
