// Lists from which pairs were dropped, closed up by a team of threads.
#pragma once

#include <cstddef>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Stands in the place of a pair that is to go.
constexpr Pair dropped_pair = ~Pair{0};

class PairGaps {
 public:
  // Pairs [begin, begin + kept) of a part are what is left of those of [begin, end).
  struct Piece {
    std::size_t begin, end, kept;
  };

  // Takes the dropped pairs out of all parts. Every one of them is in one of `gaps`, whose order is
  // lost. Pairs before a part's first gap are not looked at.
  void close(std::vector<PairList::Segment>& gaps, int threads, PairList& pairs);
  // Makes the pieces, which follow each other to the end of the part, one.
  void join(const std::vector<Piece>& pieces, int threads, Buffer<Pair>& part);
  std::size_t bytes() const { return bytesOf(pieces_, targets_, heads_); }

 private:
  using Gap = const PairList::Segment*;
  void closePart(Gap begin, Gap end, int threads, Buffer<Pair>& part);

  std::vector<Piece> pieces_;
  std::vector<std::size_t> targets_;  // where the pieces' pairs are to begin
  Buffer<Pair> heads_;                // the pairs that move into other pieces
};

// Moves what is left of pairs [begin, end) to `to`, which is not behind `begin`; returns the end of
// it.
Pair* moveKept(const Pair* begin, const Pair* end, Pair* to);

}  // namespace ode_parallel_sap
