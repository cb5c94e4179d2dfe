// Frames in which everything moves, but by little: the pairs of larger boxes are kept.
#pragma once

#include <cstddef>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/base/tuning.h"
#include "space/cache/changed_pairs.h"
#include "space/pairs/sweep.h"

namespace ode_parallel_sap {

// Each box gets a fat one, a box with a margin. While boxes stay in their fat ones, the pairs that
// overlap are among the candidates, the pairs of fat boxes. A frame tests these and searches
// nothing. Boxes that leave get other fat ones, whose candidates are found anew. With a tolerance
// all candidates are pairs. Without one, boxes that share a move since they got fat boxes are
// compared less that move: rounding keeps the order of bounds, so no pair is missed.
class FatProxies {
 public:
  // Whether find() should find the pairs of these boxes, which are floats: they have moved little,
  // or together, in the last frames, and did not leave the last fat ones too soon. With a
  // `tolerance` that is enough for their motion margins are a part of it, and all candidates are
  // pairs.
  bool prepare(const BoxSet& boxes, double tolerance, int threads);
  // A frame did without. After many in a row nothing is held.
  void noteUnused();
  // Finds the pairs of the boxes that prepare() saw, as PairFinder::find does. Once it threw, it is
  // to be replaced.
  int find(const BoxSet& boxes, int threads, Sweep<float>& sweep, const PairTest& test,
           PairList& pairs);

  // Candidates that the last find() did not find anew.
  std::size_t kept() const { return kept_; }
  // Each box, less the shared move, lies in its fat box, with its filters, and candidates are all
  // pairs of fat boxes. Also validates the sweep's trees, if these are of the fat boxes.
  void validate(const BoxSet& boxes, const Sweep<float>& sweep) const;
  std::size_t bytes() const {
    return bytesOf(fat_, candidates_, left_, leaving_, changed_pairs_, sample_);
  }

 private:
  bool followSample(const BoxSet& boxes);
  static Box movedBack(const Box& box, const Box& move);
  Box sharedMove(const BoxSet& boxes) const;
  void restartMove();
  Box moved() const;
  float usefulTolerance(const BoxSet& boxes, double tolerance);
  bool filtersChanged(const BoxSet& boxes, Slot slot) const;
  void listLeft(const BoxSet& boxes, int threads);
  void fatten(const BoxSet& boxes, Slot slot, float share);
  int start(const BoxSet& boxes, int threads, Sweep<float>& sweep);
  int follow(const BoxSet& boxes, int threads, Sweep<float>& sweep);
  int testCandidates(const BoxSet& boxes, int threads, const PairTest& test, PairList& pairs);
  void stop();

  // A box when the sample was taken, or since it is there less the shared move, and in the last
  // frame, and how far from the first it has been, shared moves apart.
  struct Sampled {
    Slot slot;
    Box first, last;
    float farthest;
  };

  float tolerance_ = 0;
  float share_ = 0;  // of a box's least extent: the margin that is of use now; 0: none is
  BackOff back_off_{4};
  int frames_ = 0;  // since all got fat boxes
  int unused_ = 0;  // frames since find()
  BoxSet fat_;      // empty while it does not run
  PairList candidates_;
  SlotSet left_;           // slots whose fat boxes or filters hold no more, and those that are gone
  Buffer<Slot> leaving_;   // those of them that are still there, ascending
  double stray_rows_ = 0;  // gone through since the sweep built its trees
  ChangedPairs changed_pairs_;
  std::size_t kept_ = 0;
  Buffer<Sampled> sample_;
  int sampled_frames_ = 0;       // since it was taken
  std::size_t sample_step_ = 0;  // slots, from each of which one is taken
  // Shared moves, lower and upper bounds alike: since the sample was taken, and what that was when
  // all got fat boxes. The difference is the move since then.
  Box since_sample_ = {}, at_start_ = {};
};

}  // namespace ode_parallel_sap
