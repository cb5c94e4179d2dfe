// Boxes by slot in a tree that is kept from query to query while some of them move.
#pragma once

#include <cstddef>
#include <cstdint>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/pairs/cell_order.h"
#include "space/pairs/cell_trees.h"

namespace ode_parallel_sap {

// The boxes are cut into cells by size and place (CellOrder), with a tree of bounds over the cells
// of each class (CellTrees). The bounds above a box that moves grow. A box that goes far becomes a
// stray, in a list that every query goes through, sixteen boxes at a time.
template <class Real>
class QueryTree {
 public:
  using RealType = Real;

  // Forgets what was there and takes the active ones of `boxes`. Uses up to `threads` threads.
  void build(const BoxSet& boxes, int threads);
  // The slot's box from now on, whether it had one or not; an inactive one takes it out. Needs
  // exactMode().
  void place(Slot slot, const BasicBox<Real>& box);
  // The same of an active box, if the bounds of its cell hold it; else false. For different slots
  // many threads may do so at once.
  bool moveWithin(Slot slot, const BasicBox<Real>& box) {
    const std::uint32_t place = placeOf(slot);
    return place < cells() * group_size &&
           trees_.moveBox(place / group_size, place % group_size, box, /*may_grow=*/false);
  }
  // Asks for what these change.
  void prefetchPlace(Slot slot) const {
    if (placeOf(slot) < cells() * group_size) trees_.prefetchCell(placeOf(slot) / group_size);
  }

  // Writes twice the slots of all boxes that overlap `box` (closed intervals), each once, in no
  // order, 1 more where floats cannot decide, and returns their number. `found` has room for
  // most(). Needs exactMode().
  std::size_t find(const BasicBox<Real>& box, std::uint32_t* found) const;
  std::size_t most() const { return places_.size() + group_size; }

  // Calls visit(slot) for all boxes that the ray meets for a t from 0 to `limit`, each once, and
  // perhaps for others; nearer ones mostly come first. Boxes beyond a limit that visit() has
  // lowered are left out. Needs exactMode().
  template <class Visit>
  void visitAlong(const RayQuery<Real>& ray, Real& limit, Visit visit) const;

  // Each active box has one place, and all other places are empty.
  void validate(const BoxSet& boxes) const;
  bool holdsNone() const { return cells() == 0 && strayRows() == 0; }
  // Rows of sixteen strays that each query goes through.
  std::size_t strayRows() const { return stray_boxes_.size(); }
  std::size_t bytes() const { return bytesOf(trees_, places_, stray_boxes_); }

 private:
  // A place is sixteen times a cell's number, counted through all classes, plus a lane. Strays
  // follow the last cell. A slot that became one keeps its place among them, empty or not.
  static constexpr std::uint32_t nowhere = ~std::uint32_t{0};

  std::size_t cells() const { return trees_.cells(); }
  std::uint32_t placeOf(Slot slot) const { return slot < places_.size() ? places_[slot] : nowhere; }
  std::uint32_t addStray(Slot slot);
  template <class Visit>
  void visitInTree(const TreeView<Real>& tree, const RayQuery<Real>& ray, Real& limit,
                   Visit visit) const;

  CellTrees<Real> trees_;
  Buffer<std::uint32_t> places_;  // by slot
  Buffer<Group<Real>> stray_boxes_;
  std::size_t strays_ = 0;
};

// The lanes of sixteen boxes that a ray meets, the nearest first.
template <class Real>
struct RayRow {
  alignas(64) Real entry[group_size];
  std::uint8_t lanes[group_size];
  int count = 0;

  RayRow(const Group<Real>& boxes, const RayQuery<Real>& ray, Real limit) {
    unsigned mask = kernels<Real>().meetRay(boxes, ray, limit, entry);
    for (; mask; mask &= mask - 1) {
      const int lane = __builtin_ctz(mask);
      int i = count++;
      for (; i > 0 && entry[lane] < entry[lanes[i - 1]]; --i) lanes[i] = lanes[i - 1];
      lanes[i] = static_cast<std::uint8_t>(lane);
    }
  }
};

template <class Real>
template <class Visit>
void QueryTree<Real>::visitInTree(const TreeView<Real>& tree, const RayQuery<Real>& ray,
                                  Real& limit, Visit visit) const {
  struct Node {
    std::uint32_t group;
    int level;
    Real entry;
  };
  Node nodes[TreeView<Real>::max_levels * group_size];
  nodes[0] = {0, tree.depth - 1, 0};
  for (int waiting = 1; waiting > 0;) {
    const Node node = nodes[--waiting];
    if (node.entry > limit) continue;
    const RayRow<Real> row(tree.levels[node.level][node.group], ray, limit);
    if (node.level == 0)
      for (int i = 0; i < row.count && row.entry[row.lanes[i]] <= limit; ++i)
        visit(tree.levels[0][node.group].slot[row.lanes[i]]);
    else
      for (int i = row.count - 1; i >= 0; --i)
        nodes[waiting++] = {node.group * group_size + row.lanes[i], node.level - 1,
                            row.entry[row.lanes[i]]};
  }
}

template <class Real>
template <class Visit>
void QueryTree<Real>::visitAlong(const RayQuery<Real>& ray, Real& limit, Visit visit) const {
  for (std::size_t i = 0; i < trees_.count(); ++i)
    if (trees_.cells(i)) visitInTree(trees_.views()[i], ray, limit, visit);
  for (std::size_t stray = 0; stray < stray_boxes_.size(); ++stray) {
    const RayRow<Real> row(stray_boxes_[stray], ray, limit);
    for (int i = 0; i < row.count && row.entry[row.lanes[i]] <= limit; ++i)
      visit(stray_boxes_[stray].slot[row.lanes[i]]);
  }
}

}  // namespace ode_parallel_sap
