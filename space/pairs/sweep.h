// Subdivided sweep and prune: the default method.
#pragma once

#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/base/tuning.h"
#include "space/pairs/cell_order.h"
#include "space/pairs/cell_trees.h"
#include "space/pairs/row_table.h"

namespace ode_parallel_sap {

// Boxes that were neighbours in one frame are neighbours in the next. Cells need not be cut anew
// while they hold the same slots and have hardly grown: any division into cells leads to the same
// pairs, and how long that takes depends on the extents of the cells.
template <class Real>
class CellCoherence {
 public:
  // Whether to try the cells of before for these boxes: if they hold all active slots and no
  // others, and are not too old. Called before cells are cut or packed.
  bool mayReuse(const BoxSet& boxes, int threads);
  // Whether they are good, `trees` being packed with the new boxes.
  bool reuse(const CellTrees<Real>& trees);
  // The cells are about to be cut anew.
  void forget() { known_ = false; }
  // Cells were cut anew for the boxes that mayReuse() saw, and packed.
  void restart(const CellTrees<Real>& trees);

  std::size_t bytes() const { return bytesOf(active_, spans_); }

 private:
  bool known_ = false;
  std::size_t size_ = 0;
  SlotSet active_;       // slots that mayReuse() saw last
  Buffer<Real> spans_;   // of all cells when they were cut
  int reuses_ = 0;       // frames since the cells were cut
  BackOff back_off_{1};  // trees over cells of no use are built in vain
};

// The boxes are dealt into regions and halved down to cells of sixteen (CellOrder), with trees of
// bounds over them (CellTrees). Each cell meets the boxes of
// later cells that overlap its bounds, sixteen tests at a time. Pairs are gathered by their earlier
// slots and put in order (RowTable). The division into cells is kept from frame to frame while the
// boxes of a cell stay together (CellCoherence).
template <class Real>
class Sweep : public PairFinder {
 public:
  using PairFinder::find;
  int find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) override;
  std::size_t bytes() const override {
    return bytesOf(order_, cell_coherence_, trees_, tasks_, rows_);
  }

  // The first half of find() alone: sorts the boxes into cells, unless those of the last time are
  // good, and packs the trees over them. What `workspace` holds is lost.
  void build(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace);
  // The trees of the last find() or build(), small boxes first.
  const CellTrees<Real>& trees() const { return trees_; }

 private:
  void planTasks(int threads);

  CellOrder<Real> order_;
  CellCoherence<Real> cell_coherence_;
  CellTrees<Real> trees_;
  std::vector<PairSearch<Real>> tasks_;
  RowTable rows_;
};

}  // namespace ode_parallel_sap
