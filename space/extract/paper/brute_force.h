// Brute force: every pair of boxes is tested.
#pragma once

#include <vector>

#include "space/cells/cell_trees.h"
#include "space/data/buffer.h"
#include "space/data/pair_finder.h"
#include "space/data/parallel.h"

namespace ode_parallel_sap {

// The multi-core algorithm of Avril, Gouranton and Arnaldi ("Collision Detection: Broad Phase
// Adaptation from Multi-Core to Multi-GPU Architecture", section 4.1): each of c threads tests
// ((n^2-n)/2)/c pairs and writes those that overlap to storage of its own, without critical
// section; in the end the parts are joined by pointer. The pairs are numbered row by row, so that
// the parts, read one after the other, are in the order of the report already.
template <class Real>
class BruteForce : public PairFinder {
 public:
  int find(const BoxSet& boxes, int threads, PairList& pairs) override;
  // The same for scenes in which more than every places_of_a_pair-th place of the table is
  // expected to be a pair. Stops, and returns 0, once fewer of the tested ones are: so a wrong
  // guess costs a number of tests in proportion to the boxes and to the pairs found, not to their
  // square.
  int findDense(const BoxSet& boxes, int threads, PairList& pairs);
  std::size_t bytes() const override { return bytesOf(starts_, cells_, borderline_); }

 private:
  // Some of the tests: a range of those of each stripe, `stripes` equal parts of the table.
  struct Round {
    int stripes, rounds, number;
    Range tests;
    std::size_t expected;  // pairs
  };
  void packCells(const BoxSet& boxes, int threads);
  int testRound(const BoxSet& boxes, const Round& round, int threads, PairList& pairs);
  void clearBorderline(int threads);
  void joinBorderline(PairList& pairs) const;

  Buffer<std::uint32_t> starts_;  // of the cells: 0, 16, 32, ...
  CellTrees<Real> cells_;         // in slot order; only its cells are used
  std::vector<std::vector<PairList::Segment>> borderline_;  // one a thread
};

}  // namespace ode_parallel_sap
