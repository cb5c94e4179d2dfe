// Boxes in cells of sixteen, with trees of bounds over the cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/platform.h"
#include "space/pairs/cell_order.h"

namespace ode_parallel_sap {

template <class Real>
inline void put(const BasicBox<Real>& box, Group<Real>& group, int lane) {
  for (int axis = 0; axis < 3; ++axis) {
    group.lower[axis][lane] = box.lower[axis];
    group.upper[axis][lane] = box.upper[axis];
  }
}

template <class Real>
inline bool isEmpty(const Group<Real>& group, std::size_t lane) {
  return group.lower[0][lane] != group.lower[0][lane];
}

// There is a tree for each class of cells (CellOrder), with sixteen children to a node. The sweep
// packs the trees anew when it searches. Fat boxes and queries keep them while some boxes move. The
// bounds above a box that moves grow. A box that goes far becomes a stray, in a list that every
// query goes through, sixteen boxes at a time.
template <class Real>
class CellTrees {
 public:
  using RealType = Real;

  // Forgets what was there and packs the boxes of an order, which is read during the call only. The
  // cells of all classes are numbered through.
  void build(const BoxSet& boxes, const CellOrder<Real>& order, int threads);
  // The same of all active ones, which may move from then on.
  void build(const BoxSet& boxes, int threads);
  // Lets the boxes move, if they may not yet.
  void numberPlaces(int threads);
  // The slot's box from now on, had it one or not; an inactive one takes it out. Needs exactMode().
  void place(Slot slot, const BasicBox<Real>& box);
  // The same of an active box, if the bounds of its cell hold it; else false. For different slots
  // many threads may do so at once.
  bool moveWithin(Slot slot, const BasicBox<Real>& box) {
    const std::uint32_t place = placeOf(slot);
    return place < cells() * group_size && move(place, box, /*may_grow=*/false);
  }
  // False: the slot has no box. Boxes may move.
  bool hasPlace(Slot slot) const { return placeOf(slot) != nowhere; }
  // Prefetches what these change.
  void prefetchPlace(Slot slot) const;

  // Writes twice the slots of all boxes that overlap `box` (closed intervals), each once, in no
  // order, 1 more where floats cannot decide, and returns their number. `found` has room for
  // most(). Needs exactMode().
  std::size_t find(const BasicBox<Real>& box, std::uint32_t* found) const;
  std::size_t most() const { return (cells() + strayRows() + 1) * group_size; }
  // Calls visit(slot) for all boxes that the ray meets for a t from 0 to `limit`, each once, and
  // perhaps for others; nearer ones mostly come first. Boxes beyond a limit that visit() has
  // lowered are left out. Needs exactMode().
  template <class Visit>
  void visitAlong(const RayQuery<Real>& ray, Real& limit, Visit visit) const;

  std::size_t count() const { return views_.size(); }
  // One a class, empty without cells. Valid until the next build, none after one that threw.
  const TreeView<Real>* views() const { return views_.data(); }
  std::size_t cells() const {
    return views_.empty() ? 0 : views_.back().first_cell + cells(views_.size() - 1);
  }
  std::size_t cells(std::size_t tree) const {
    return views_[tree].depth ? views_[tree].groups[0] : 0;
  }
  bool holdsNone() const { return cells() == 0 && strayRows() == 0; }
  // Rows of sixteen strays that each query goes through.
  std::size_t strayRows() const { return stray_boxes_.size(); }
  // A node's bounds hold those of all below it, each active box has one place, and all other places
  // are empty but for those of slots that are gone.
  void validate(const BoxSet& boxes) const;
  std::size_t bytes() const { return bytesOf(groups_, filters_, views_, places_, stray_boxes_); }

 private:
  // A place is sixteen times a cell's number plus a lane. Strays follow the last cell. A slot that
  // became one keeps its place among them, empty or not.
  static constexpr std::uint32_t nowhere = ~std::uint32_t{0};

  std::uint32_t placeOf(Slot slot) const { return slot < places_.size() ? places_[slot] : nowhere; }
  Group<Real>* level(const TreeView<Real>& view, int depth) {
    return groups_.data() + (view.levels[depth] - groups_.data());
  }
  void layOut(const std::vector<std::uint32_t>& class_ends, bool filtered);
  void packFilters(const BoxSet& boxes, std::size_t begin, std::size_t end);
  bool move(std::uint32_t place, const BasicBox<Real>& box, bool may_grow);
  template <class Visit>
  void visitInTree(const TreeView<Real>& tree, const RayQuery<Real>& ray, Real& limit,
                   Visit visit) const;

  Buffer<Group<Real>> groups_;  // the cells of all trees, then the upper levels of each
  Buffer<GroupFilter> filters_;
  std::vector<TreeView<Real>> views_;
  std::size_t slots_ = 0;         // when the trees were built
  Buffer<std::uint32_t> places_;  // by slot; empty until boxes may move
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
  // Calls visit(slot) for these boxes, up to the limit.
  template <class Visit>
  void forSlots(const Group<Real>& boxes, const Real& limit, Visit visit) const {
    for (int i = 0; i < count && entry[lanes[i]] <= limit; ++i) visit(boxes.slot[lanes[i]]);
  }
};

template <class Real>
template <class Visit>
void CellTrees<Real>::visitInTree(const TreeView<Real>& tree, const RayQuery<Real>& ray,
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
    const Group<Real>& group = tree.levels[node.level][node.group];
    const RayRow<Real> row(group, ray, limit);
    if (node.level == 0)
      row.forSlots(group, limit, visit);
    else
      for (int i = row.count - 1; i >= 0; --i)
        nodes[waiting++] = {node.group * group_size + row.lanes[i], node.level - 1,
                            row.entry[row.lanes[i]]};
  }
}

template <class Real>
template <class Visit>
void CellTrees<Real>::visitAlong(const RayQuery<Real>& ray, Real& limit, Visit visit) const {
  for (std::size_t i = 0; i < count(); ++i)
    if (cells(i)) visitInTree(views_[i], ray, limit, visit);
  for (const Group<Real>& strays : stray_boxes_)
    RayRow<Real>(strays, ray, limit).forSlots(strays, limit, visit);
}

}  // namespace ode_parallel_sap
