// Frames in which everything moves, but by little: the pairs of larger boxes are kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/coherence/incremental.h"
#include "space/coherence/kept_pairs.h"
#include "space/data/box_set.h"
#include "space/data/buffer.h"
#include "space/data/pair_list.h"
#include "space/data/slot_set.h"
#include "space/extract/sweep.h"

namespace ode_parallel_sap {

// Each box gets a fat one, with room around it. While boxes stay in their fat ones, the pairs that
// overlap are among those of the fat boxes, the candidates, which are kept in their order: a frame
// tests these and searches nothing. Few boxes that leave theirs get others, whose pairs are found
// (Incremental) and put in. What comes of it is what PairFinder::find would find for the boxes of
// the frame, and follows from these boxes alone: who changed them, and how, need not be told.
//
// Holds, while it runs, 36 bytes a slot and 8 a candidate.
class FatPairs {
 public:
  enum class Outcome {
    not_tried,
    off,      // boxes move so far that they would not stay in fat ones
    started,  // all got fat boxes
    served,   // candidates were kept
    in_vain   // too many left their fat boxes in the first frame after they got them
  };

  // Whether find() should find the pairs of these boxes, which are floats: if it kept candidates
  // or, with the outcome `started`, would make some. To be asked in each frame that could be found
  // so: from one to the next it sees how far boxes move. `sweep` is the one that find() gets.
  Outcome look(const BoxSet& boxes, int threads, const Sweep<float>& sweep);
  // Finds the pairs of the boxes that look() has seen, as PairFinder::find does. The sweep's trees
  // are those of the fat boxes afterwards.
  int find(const BoxSet& boxes, int threads, Sweep<float>& sweep, PairList& pairs);

  // A frame was found without a look(). After many in a row nothing is held any more.
  void passOver();

  // Of the last find(): candidates that were not looked for again.
  std::size_t kept() const { return kept_; }
  std::size_t bytes() const {
    return bytesOf(fat_, candidates_, changed_, leaving_, incremental_, found_, kept_pairs_,
                   sample_, borderline_);
  }

 private:
  bool isSlow(const BoxSet& boxes);
  bool filtersChanged(const BoxSet& boxes, Slot slot) const;
  void lookForLeaving(const BoxSet& boxes, int threads);
  void resizeTo(const BoxSet& boxes);
  void fatten(const BoxSet& boxes, Slot slot, float share);
  int start(const BoxSet& boxes, int threads, Sweep<float>& sweep);
  int follow(const BoxSet& boxes, int threads, Sweep<float>& sweep);
  int test(const BoxSet& boxes, int threads, PairList& pairs);
  void stop();

  bool running_ = false;
  int served_ = 0;            // frames since all got fat boxes
  int passed_over_ = 0;       // frames since the last look()
  std::uint64_t builds_ = 0;  // of the sweep, when its trees were last made
  bool incremental_started_ = false;
  BoxSet fat_;
  PairList candidates_;
  SlotSet changed_;       // slots whose fat boxes or filters hold no more, and those that are gone
  Buffer<Slot> leaving_;  // those of them that are still there, ascending
  Incremental<float> incremental_;
  PairList found_;
  KeptPairs kept_pairs_;
  std::size_t kept_ = 0;
  Buffer<Box> sample_;                                      // some boxes of the last frame
  std::size_t sampled_ = 0;                                 // of so many slots; 0: none
  std::vector<std::vector<PairList::Segment>> borderline_;  // one a thread
};

}  // namespace ode_parallel_sap
