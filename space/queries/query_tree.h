// Boxes by slot in a tree that is kept from query to query while some of them move.
#ifndef ODE_PARALLEL_SAP_QUERY_TREE_H
#define ODE_PARALLEL_SAP_QUERY_TREE_H

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/cells/cell_order.h"
#include "space/cells/cell_tree.h"
#include "space/data/box_set.h"
#include "space/data/buffer.h"

namespace ode_parallel_sap {

// The boxes are cut into cells by size and place (CellOrder), with a tree of bounds over the cells
// of each class (CellTree); the bounds of the cells are wider than their boxes. A box that moves
// within them is written where it is. One that leaves them becomes a stray: it is taken out of its
// cell and put into a list that every query goes through, sixteen boxes at a time. So the tree's
// bounds never change, and a query's cost is that of the tree as built plus the strays, whose
// number says when to build anew.
template <class Real>
class QueryTree {
 public:
  using RealType = Real;

  // Forgets what was there and takes the active ones of `boxes`. Uses up to `threads` threads.
  void build(const BoxSet& boxes, int threads);
  // The slot's box from now on, whether it had one or not; an inactive one takes it out. Needs
  // exactMode().
  void place(Slot slot, const BasicBox<Real>& box);
  // Whether that would leave the slot's box in the cell where it is, or out of all.
  bool fits(Slot slot, const BasicBox<Real>& box) const;

  // Writes the slots of all boxes that overlap `box` (closed intervals), each once, in no order,
  // and returns their number. `found` has room for as many as there may be, and for `spare` more.
  // Needs exactMode().
  std::size_t find(const BasicBox<Real>& box, Slot* found) const;
  static constexpr std::size_t spare = group_size;

  // Rows of sixteen strays that each query goes through.
  std::size_t strayRows() const { return stray_boxes_.size(); }
  // Gives back what only build() needs.
  void releaseScratch();
  // Gives everything back. Call build() before anything else.
  void release();
  std::size_t bytes() const;

 private:
  // A place is sixteen times a cell's number, counted through all classes, plus a lane. Strays
  // follow the last cell.
  static constexpr std::uint32_t nowhere = ~std::uint32_t{0};

  std::size_t cells() const { return first_cells_.empty() ? 0 : first_cells_.back(); }
  std::size_t classOf(std::size_t cell) const;
  void setStray(std::uint32_t place, const BasicBox<Real>& box);
  void addStray(Slot slot, const BasicBox<Real>& box);

  CellOrder<Real> order_;
  std::vector<CellTree<Real>> trees_;     // one a class
  std::vector<std::size_t> first_cells_;  // of the classes; the last one is the number of all
  Buffer<std::uint32_t> places_;          // by slot
  Buffer<Group<Real>> stray_boxes_;
  Buffer<GroupIds> stray_ids_;
  Buffer<std::uint32_t> free_strays_;  // places among the strays
};

}  // namespace ode_parallel_sap

#endif
