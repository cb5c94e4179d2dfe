// Subdivided sweep and prune: the default method.
#pragma once

#include <utility>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/base/tuning.h"
#include "space/pairs/cell_order.h"
#include "space/pairs/cell_trees.h"
#include "space/pairs/row_table.h"

namespace ode_parallel_sap {

// The boxes are dealt into regions and halved down to cells of sixteen (CellOrder), with trees of
// bounds over them (CellTrees). Each cell meets the boxes of later cells that overlap its bounds,
// sixteen tests at a time. Pairs are gathered by their earlier slots and put in order (RowTable).
//
// Boxes that were neighbours in one frame are neighbours in the next. So cells are kept from frame
// to frame while they hold the same slots and have hardly grown. Any division into cells leads to
// the same pairs, and how long that takes depends on the extents of the cells.
template <class Real>
class Sweep : public PairFinder {
 public:
  using PairFinder::find;
  int find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) override;
  std::size_t bytes() const override {
    return bytesOf(order_, trees_, tasks_, rows_, active_, spans_);
  }

  // The first half of find() alone: sorts the boxes into cells, unless those of the last time are
  // good, and packs the trees over them. What `workspace` holds is lost.
  void build(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace);
  // Whether these were the boxes of the last find() or build().
  bool holds(const BoxSet& boxes) const { return packed_ == &boxes; }
  // Their trees, in which boxes may be placed until the next one. Small boxes come first.
  CellTrees<Real>& trees() { return trees_; }
  const CellTrees<Real>& trees() const { return trees_; }
  // Gives them away, for storage of other ones.
  void exchangeTrees(CellTrees<Real>& trees) {
    std::swap(trees_, trees);
    packed_ = nullptr;
  }

 private:
  bool mayReuseCells(const BoxSet& boxes, int threads);
  bool areGoodCells();
  template <class Use>
  void forSpans(Use use) const;

  CellOrder<Real> order_;
  CellTrees<Real> trees_;
  const BoxSet* packed_ = nullptr;
  std::vector<PairSearch<Real>> tasks_;
  RowTable rows_;
  // Of the cells.
  bool has_cells_ = false;
  std::size_t size_ = 0;  // slots of the last frame
  SlotSet active_;        // those of them that take part
  Buffer<Real> spans_;    // of all cells when they were cut
  int reuses_ = 0;        // frames since then
  BackOff back_off_{1};   // from trees over cells that have grown
};

}  // namespace ode_parallel_sap
