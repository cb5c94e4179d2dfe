// Pairs and boxes that are found by walking a tree over cells. Internal linkage, as in
// kernels_impl.h.
#pragma once

#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/simd/kernel_rows.h"

namespace {

// Boxes that the query's bounds reach, each as its cell and place in it: group_size * cell + lane.
struct Candidates {
  static constexpr std::size_t capacity = 512;  // fixed: 2 kB

  alignas(64) std::uint32_t place[capacity + group_size];
  std::size_t count = 0;

  bool full() const { return count > capacity - group_size; }

  // Adds the boxes of `cell` in `mask`; at most 16 places are written beyond `count`.
  void add(std::size_t cell, unsigned mask) {
    Lanes::writeNumbers(static_cast<std::uint32_t>(cell * group_size), mask, place + count);
    count += __builtin_popcount(mask);
  }
};

// Pairs of box `lane` of `cell` with the `hits` of the query's boxes.
template <class Real>
inline void writeCandidate(const Query<Real>& query, const TreeView<Real>& tree, std::size_t cell,
                           unsigned lane, unsigned hits, PairSink& sink) {
  if (query.filter) {
    hits &= passesFilter(tree.filters[cell], lane, query.filter->category, query.filter->collide,
                         query.filter->body);
    if (!hits) return;
  }
  makeRoom(sink, group_size);
  std::uint64_t* const first = sink.next;
  sink.next += Lanes::writePairs(query.ids->slot, tree.ids[cell].slot[lane], hits, first);
  if (query.exact) return;
  const unsigned borderline = borderlineOf(rowOf(*query.boxes), tree.levels[0][cell], lane, hits);
  if (borderline) markBorderline(first, hits, borderline);
}

// Pairs of all candidates, which are used up, with the sixteen boxes of the query: these stay in
// registers, and of a candidate nothing is copied. As in boxesAgainstRow, all are met before a pair
// is written.
template <class Real>
inline void meetCandidates(const Query<Real>& query, const TreeView<Real>& tree, Candidates& others,
                           PairSink& sink) {
  const Row<Real> row = rowOf(*query.boxes);
  std::uint16_t masks[Candidates::capacity];
  std::size_t hit = 0;
  for (std::size_t i = 0; i < others.count; ++i) {
    const std::uint32_t place = others.place[i];
    const unsigned mask = row.overlapping(tree.levels[0][place / group_size], place % group_size);
    others.place[hit] = place;
    masks[hit] = static_cast<std::uint16_t>(mask);
    hit += mask != 0;
  }
  for (std::size_t i = 0; i < hit; ++i)
    writeCandidate(query, tree, others.place[i] / group_size, others.place[i] % group_size,
                   masks[i], sink);
  others.count = 0;
}

// A box that many rows are tested against: a copy, so that it may stay in registers whatever is
// written meanwhile.
template <class Real>
struct OneBox {
  Real lower[3][1], upper[3][1];

  OneBox(const Group<Real>& boxes, unsigned lane) {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis][0] = boxes.lower[axis][lane];
      upper[axis][0] = boxes.upper[axis][lane];
    }
  }
};

// Cells that are gathered, so that a query meets sixteen of them at a time: their bounds and
// numbers.
template <class Real>
struct CellCandidates {
  static constexpr std::size_t capacity = 2048 / sizeof(Real);
  static constexpr std::size_t stride = capacity + group_size;

  alignas(64) Real lower[3][stride];
  alignas(64) Real upper[3][stride];
  alignas(64) std::uint32_t cell[stride];
  alignas(64) std::uint32_t chosen[stride];
  std::size_t count = 0;

  bool full() const { return count > capacity - group_size; }

  // Adds the cells in `mask` of the sixteen from `first_cell` on, whose bounds are `bounds`.
  void add(const Group<Real>& bounds, std::uint32_t first_cell, unsigned mask) {
    for (int axis = 0; axis < 3; ++axis) {
      Lanes::compress(bounds.lower[axis], mask, lower[axis] + count);
      Lanes::compress(bounds.upper[axis], mask, upper[axis] + count);
    }
    Lanes::writeNumbers(first_cell, mask, cell + count);
    count += __builtin_popcount(mask);
  }

  // Puts the cells from `first` on whose bounds overlap `box` into chosen[], and returns their
  // number.
  std::size_t choose(const OneBox<Real>& box, std::uint32_t first) {
    for (int i = 0; i < group_size; ++i)
      lower[0][count + i] = static_cast<Real>(__builtin_nanf(""));
    std::size_t number = 0;
    for (std::size_t base = 0; base < count; base += group_size) {
      const unsigned mask =
          Row<Real>(lower[0] + base, upper[0] + base, stride).overlapping(box, 0) &
          ~Lanes::below(cell + base, first);
      Lanes::compress(cell + base, mask, chosen + number);
      number += __builtin_popcount(mask);
    }
    return number;
  }
};

// Calls visit(node, mask) for the nodes just above the cells of `tree`, from that of cell `first`
// on: `mask` has those of its sixteen cells whose bounds overlap box `lane` of `box`.
template <class Real, class Visit>
inline void forOverlappingNodes(const TreeView<Real>& tree, const Group<Real>& box, unsigned lane,
                                std::size_t first, Visit visit) {
  struct Node {
    std::uint32_t level, group;
  };
  // A node leaves at most 15 siblings a level behind on the stack.
  Node stack[TreeView<Real>::max_levels * group_size];
  int top = 0;
  stack[top++] = {static_cast<std::uint32_t>(tree.depth - 1), 0};
  while (top) {
    const Node node = stack[--top];
    unsigned mask = overlaps(box, lane, tree.levels[node.level][node.group]);
    if (node.level == 1) {
      if (mask) visit(node.group, mask);
      continue;
    }
    const std::size_t base = std::size_t{node.group} * group_size;
    const std::size_t from = first >> 4 * (node.level - 1);
    if (from > base) mask = from - base < group_size ? mask >> (from - base) << (from - base) : 0;
    for (; mask; mask &= mask - 1)
      stack[top++] = {node.level - 1, static_cast<std::uint32_t>(base + __builtin_ctz(mask))};
  }
}

// The tree whose cells are queries, and the cells of all trees.
template <class Real>
struct Meeting {
  const TreeView<Real>& own;
  TreeView<Real> all = {};  // cells without a tree
  bool exact;

  explicit Meeting(const CellMeeting<Real>& of) : own(of.trees[of.own]), exact(of.exact) {
    all.levels[0] = own.levels[0] - own.first_cell;
    all.ids = own.ids - own.first_cell;
    if (own.filters) all.filters = own.filters - own.first_cell;
  }
};

// Pairs of the own cells [begin, end), which are all below one node, with those of the gathered
// cells that are behind them, and, if `within`, within each. Uses the gathered cells up.
template <class Real>
inline void meetCells(const Meeting<Real>& meeting, std::size_t begin, std::size_t end, bool within,
                      CellCandidates<Real>& cells, Candidates& boxes, PairSink& sink) {
  const TreeView<Real>&own = meeting.own, &all = meeting.all;
  for (std::size_t i = begin; i < end; ++i) {
    const std::size_t cell = own.first_cell + i;
    const OneBox<Real> bounds(own.levels[1][i / group_size], i % group_size);
    const std::size_t others = cells.choose(bounds, static_cast<std::uint32_t>(cell + 1));
    if (!others && !within) continue;
    const Query<Real> query(all, cell, meeting.exact);
    if (within) {
      makeRoom(sink, group_size * group_size);
      boxesAgainstRow(
          query, rowOf(all.levels[0][cell]), idsOf(all, cell),
          [](unsigned box) { return all_lanes << (box + 1); }, sink);
    }
    for (std::size_t chosen = 0; chosen < others; ++chosen) {
      const std::size_t other = cells.chosen[chosen];
      boxes.add(other, rowOf(all.levels[0][other]).overlapping(bounds, 0));
      if (boxes.full()) meetCandidates(query, all, boxes, sink);
    }
    meetCandidates(query, all, boxes, sink);
  }
  cells.count = 0;
}

// The trees are walked once for all cells below one node; then each of them chooses among what was
// found.
template <class Real>
void cellPairs(const CellMeeting<Real>& of, PairSink& sink) {
  const Meeting<Real> meeting(of);
  CellCandidates<Real> gathered;
  Candidates boxes;
  for (std::size_t begin = of.begin, end; begin < of.end; begin = end) {
    const std::size_t node = begin / group_size, node_end = (node + 1) * group_size;
    end = node_end < of.end ? node_end : of.end;
    // The bounds of all cells below the node.
    Group<Real> bounds;
    const Group<Real>& cells = meeting.own.levels[1][node];
    for (int axis = 0; axis < 3; ++axis) {
      bounds.lower[axis][0] = Lanes::least(cells.lower[axis]);
      bounds.upper[axis][0] = Lanes::greatest(cells.upper[axis]);
    }
    for (std::size_t i = of.own; i < of.tree_count; ++i) {
      const TreeView<Real>& tree = of.trees[i];
      const std::size_t first = i == of.own ? begin : 0;
      forOverlappingNodes(tree, bounds, 0, first, [&](std::uint32_t group, unsigned mask) {
        gathered.add(tree.levels[1][group], tree.first_cell + group * group_size, mask);
        if (gathered.full()) meetCells(meeting, begin, end, false, gathered, boxes, sink);
      });
    }
    meetCells(meeting, begin, end, true, gathered, boxes, sink);
  }
}

// Calls meet(cells, count) for the cells of `tree` whose bounds overlap box `lane` of `box`, many
// at a time, so that a processor need not know what is in one to read the next.
template <class Real, class Meet>
inline void forOverlappingCells(const TreeView<Real>& tree, const Group<Real>& box, unsigned lane,
                                Meet meet) {
  std::uint32_t cells[gathered_nodes + group_size];
  std::size_t count = 0;
  forOverlappingNodes(tree, box, lane, 0, [&](std::uint32_t node, unsigned mask) {
    Lanes::writeNumbers(node * group_size, mask, cells + count);
    count += __builtin_popcount(mask);
    if (count < gathered_nodes) return;
    meet(cells, count);
    count = 0;
  });
  meet(cells, count);
}

template <class Real>
void boxPairs(const TreeView<Real>& queries, std::size_t begin, std::size_t end,
              const TreeView<Real>& tree, bool exact, PairSink& sink) {
  for (std::size_t cell = begin; cell < end; ++cell) {
    const Query<Real> query(queries, cell, exact);
    for (unsigned lane = 0; lane < query.count; ++lane)
      forOverlappingCells(tree, *query.boxes, lane, [&](std::uint32_t* cells, std::size_t count) {
        std::uint16_t hits[gathered_nodes + group_size];
        std::size_t hit = 0;
        for (std::size_t i = 0; i < count; ++i) {
          const std::uint32_t other = cells[i];
          const unsigned mask = overlaps(*query.boxes, lane, tree.levels[0][other]);
          cells[hit] = other;
          hits[hit] = static_cast<std::uint16_t>(mask);
          hit += mask != 0;
        }
        makeRoom(sink, hit * group_size);
        for (std::size_t i = 0; i < hit; ++i)
          writeHits(query, lane, hits[i], rowOf(tree.levels[0][cells[i]]), idsOf(tree, cells[i]),
                    sink);
      });
  }
}

// A box that meets cells, and where the slots of the boxes that it overlaps go.
template <class Real>
struct Finder {
  const Group<Real>& box;
  std::uint32_t* next;

  void meet(const Group<Real>& boxes, const GroupIds& ids) {
    const Row<Real> row = rowOf(boxes);
    const unsigned hits = row.overlapping(box, 0);
    Lanes::compress(ids.slot, hits, next);
    const unsigned borderline = hits ? borderlineOf(row, box, 0, hits) : 0;
    if (borderline) markBorderline(next, hits, borderline);
    next += __builtin_popcount(hits);
  }
};

template <class Real>
std::size_t findInTree(const TreeView<Real>& tree, const Group<Real>& box, std::uint32_t* found) {
  Finder<Real> finder = {box, found};
  forOverlappingCells(tree, box, 0, [&](const std::uint32_t* cells, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      finder.meet(tree.levels[0][cells[i]], tree.ids[cells[i]]);
  });
  return finder.next - found;
}

template <class Real>
std::size_t findInCells(const Group<Real>* cells, const GroupIds* ids, std::size_t count,
                        const Group<Real>& box, std::uint32_t* found) {
  Finder<Real> finder = {box, found};
  for (std::size_t cell = 0; cell < count; ++cell) finder.meet(cells[cell], ids[cell]);
  return finder.next - found;
}

}  // namespace
