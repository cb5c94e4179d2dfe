// What a frame did: written by the stages, read by the policy and for the statistics.
#pragma once

#include <cstddef>

#include "space/coherence/fat_pairs.h"
#include "space/coherence/pair_keeper.h"
#include "space/extract/extraction.h"

namespace ode_parallel_sap {

// What frames of all kinds count: all that the smallest scenes tell, where no stage but the report
// has a time of its own.
struct FrameCounts {
  std::size_t geoms = 0, moved = 0, disabled = 0, invalid = 0, unbounded = 0, candidates = 0,
              pairs = 0;
};

struct FrameResult : FrameCounts {
  // Of the update.
  PairKeeper::Outcome coherence = PairKeeper::Outcome::not_tried;
  bool wide = false;  // the boxes were doubles
  FatPairs::Outcome fat_pairs = FatPairs::Outcome::not_tried;
  unsigned long long fat_candidates = 0;
  // Of the extraction, if the frame was found anew, and of the stages together.
  Found found;
  int threads = 1;                            // of the widest stage that finds pairs
  int narrow_threads = 0, block_threads = 0;  // of what followed, if it did
  unsigned long long kept = 0, contacts = 0, apart = 0;

  // Milliseconds.
  double update_ms = 0, synchronise_ms = 0, extract_ms = 0, filter_ms = 0, events_ms = 0,
         narrow_ms = 0, report_ms = 0, total_ms = 0;
  double found_ms() const { return update_ms + synchronise_ms + extract_ms + filter_ms; }

  bool byFatPairs() const {
    return fat_pairs == FatPairs::Outcome::started || fat_pairs == FatPairs::Outcome::served;
  }
  bool anew() const { return coherence != PairKeeper::Outcome::kept; }
};

}  // namespace ode_parallel_sap
