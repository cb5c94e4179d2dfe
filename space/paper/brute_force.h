// Brute force: every pair of boxes is tested.
#pragma once

#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/pairs/cell_trees.h"

namespace ode_parallel_sap {

// The multi-core algorithm of Avril, Gouranton and Arnaldi ("Collision Detection: Broad Phase
// Adaptation from Multi-Core to Multi-GPU Architecture", section 4.1): each of c threads tests
// ((n^2-n)/2)/c pairs, up to a row, and writes those that overlap to storage of its own, without
// critical section; in the end the parts are joined by pointer. The pairs are numbered row by row,
// so that the parts, read one after the other, are in the order of the report already.
template <class Real>
class BruteForce : public PairFinder {
 public:
  using PairFinder::find;
  int find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) override;
  std::size_t bytes() const override { return bytesOf(cells_, rows_); }

 private:
  void packCells(const BoxSet& boxes);
  int testAll(const BoxSet& boxes, std::uint64_t tests, int threads, PairList& pairs);

  Buffer<Group<Real>> cells_;                // in slot order
  std::vector<Buffer<std::uint32_t>> rows_;  // one a thread
};

}  // namespace ode_parallel_sap
