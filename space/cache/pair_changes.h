// What became of a list of pairs.
#pragma once

#include <cstddef>

#include "space/data/buffer.h"

namespace ode_parallel_sap {

// Of a piece of the new pairs, and of the old ones that belong there. Ascending.
struct alignas(64) PairChanges {
  Buffer<std::size_t> begun;  // places in the piece
  Buffer<std::size_t> ended;  // places among all old pairs

  void clear() {
    begun.resizeDiscarding(0);
    ended.resizeDiscarding(0);
  }
  std::size_t bytes() const { return bytesOf(begun, ended); }
};

// Such a piece.
struct ChangedPiece {
  std::size_t old_begin, old_end;  // places
  const PairChanges* changes;
};

}  // namespace ode_parallel_sap
