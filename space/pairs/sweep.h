// Subdivided sweep and prune: the default method.
#pragma once

#include <vector>

#include "space/base/pair_finder.h"
#include "space/pairs/cell_coherence.h"
#include "space/pairs/cell_order.h"
#include "space/pairs/cell_trees.h"
#include "space/pairs/pair_order.h"

namespace ode_parallel_sap {

// The boxes are sorted once, not along an axis but along a curve through space (CellOrder), and cut
// into cells of sixteen. The sweep goes along that order: each cell meets the cells ahead of it
// whose bounds it overlaps, found through trees of bounds (CellTrees), and each box of the one is
// tested against the sixteen of the other in a few instructions. A pair of boxes belongs to one
// pair of cells, so none is found twice. The division into cells is kept from frame to frame while
// the boxes of a cell stay together (CellCoherence).
template <class Real>
class Sweep : public PairFinder {
 public:
  int find(const BoxSet& boxes, int threads, PairList& pairs) override;
  std::size_t bytes() const override {
    return bytesOf(order_, cell_coherence_, trees_, tasks_, found_, pair_order_);
  }

  // The first half of find() alone: sorts the boxes into cells, unless those of the last time are
  // good, and packs the trees over them.
  void build(const BoxSet& boxes, int threads);
  // How often the trees were made others.
  std::uint64_t builds() const { return builds_; }
  // The trees of the last find() or build(), small boxes first.
  const CellTrees<Real>& trees() const { return trees_; }
  // Slot i becomes slots[i] in all trees: for boxes that were gathered from a larger set.
  void renumber(const Slot* slots) { trees_.renumber(slots); }

 private:
  void planTasks(const BoxSet& boxes, int threads);
  void releaseSpare(std::size_t slots);

  CellOrder<Real> order_;
  CellCoherence<Real> cell_coherence_;
  std::uint64_t builds_ = 0;
  CellTrees<Real> trees_;
  std::vector<CellMeeting<Real>> tasks_;
  std::vector<Buffer<Pair>> found_;  // one a thread
  PairOrder pair_order_;
};

}  // namespace ode_parallel_sap
