// The kernels for the `Lanes` that the including file chose. Everything here has internal linkage:
// each including file is compiled for an instruction set of its own, and no function of it may be
// shared with, or replaced by, another file's.
#ifndef ODE_PARALLEL_SAP_SIMD_KERNELS_IMPL_H
#define ODE_PARALLEL_SAP_SIMD_KERNELS_IMPL_H

#include <string.h>

#include "../box_set.h"
#include "kernels.h"

namespace {

using namespace ode_parallel_sap;

constexpr unsigned all_lanes = 0xffff;

// Which boxes of `boxes` overlap box `lane` of `box`, as closed intervals. NaN overlaps nothing.
// The formula holds for inverted boxes too, and so do bounds made of least and greatest ones.
inline unsigned overlaps(const Group& box, unsigned lane, const Group& boxes) {
  return Lanes::atLeast(boxes.upper[0], box.lower[0][lane]) &
         Lanes::atMost(boxes.lower[0], box.upper[0][lane]) &
         Lanes::atLeast(boxes.upper[1], box.lower[1][lane]) &
         Lanes::atMost(boxes.lower[1], box.upper[1][lane]) &
         Lanes::atLeast(boxes.upper[2], box.lower[2][lane]) &
         Lanes::atMost(boxes.lower[2], box.upper[2][lane]);
}

// Two steps toward `direction` (1 up, -1 down) in the order of all floats; NaN beyond infinity.
inline float twoSteps(float value, int direction) {
  std::int32_t bits;
  memcpy(&bits, &value, sizeof bits);
  bits ^= (bits >> 31) & 0x7fffffff;  // order of the integers = order of the floats
  bits = static_cast<std::int32_t>(static_cast<std::uint32_t>(bits) + 2u * direction);
  bits ^= (bits >> 31) & 0x7fffffff;
  memcpy(&value, &bits, sizeof bits);
  return value;
}

// The boxes of a cell, shrunk so far that a shrunk box can only overlap another box's float bounds
// if the exact boxes overlap: an exact bound is less than one step inside its float bound, for
// both.
inline void shrink(const Group& cell, Group& inner) {
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < group_size; ++i) {
      inner.lower[axis][i] = twoSteps(cell.lower[axis][i], 1);
      inner.upper[axis][i] = twoSteps(cell.upper[axis][i], -1);
    }
}

inline unsigned passesFilter(const GroupFilter& filter, unsigned lane, const GroupFilter& others) {
  const unsigned wanted = Lanes::sharesBits(others.collide, filter.category[lane]) |
                          Lanes::sharesBits(others.category, filter.collide[lane]);
  const std::uint32_t body = filter.body[lane];
  return body ? wanted & ~Lanes::equals(others.body, body) : wanted;
}

// One cell as the side whose boxes are taken one by one.
struct Side {
  const Group* boxes;
  const GroupIds* ids;
  const GroupFilter* filter;  // null: no pair is filtered
};

inline Side sideOf(const TreeView& tree, std::size_t cell) {
  return {tree.levels[0] + cell, tree.ids + cell, tree.filters ? tree.filters + cell : nullptr};
}

// Pairs of box `lane` of `a` with the boxes in `candidates` of `b`.
inline void boxAgainstCell(const Side& a, unsigned lane, const Side& b, unsigned candidates,
                           bool exact, PairSink& sink) {
  unsigned hits = overlaps(*a.boxes, lane, *b.boxes) & candidates;
  if (!hits) return;
  if (a.filter) {
    hits &= passesFilter(*a.filter, lane, *b.filter);
    if (!hits) return;
  }
  std::uint64_t* const first = sink.next;
  sink.next += Lanes::writePairs(b.ids->slot, a.ids->slot[lane], hits, first);
  if (exact) return;
  Group inner;
  for (int axis = 0; axis < 3; ++axis) {
    inner.lower[axis][0] = twoSteps(a.boxes->lower[axis][lane], 1);
    inner.upper[axis][0] = twoSteps(a.boxes->upper[axis][lane], -1);
  }
  const unsigned unsure = hits & ~overlaps(inner, 0, *b.boxes);
  if (!unsure) return;
  std::uint64_t* pair = first;
  for (unsigned rest = hits; rest; rest &= rest - 1, ++pair)
    if (unsure & rest & (0u - rest)) *pair |= std::uint64_t{1} << 63;
}

inline void makeRoom(PairSink& sink) {
  constexpr std::ptrdiff_t room = group_size * group_size;
  if (sink.end - sink.next < room) sink.grow(sink, room);
}

// Pairs within one cell.
inline void cellAgainstItself(const Side& cell, bool exact, PairSink& sink) {
  makeRoom(sink);
  for (unsigned lane = 0; lane + 1 < group_size; ++lane)
    boxAgainstCell(cell, lane, cell, all_lanes << (lane + 1) & all_lanes, exact, sink);
}

// Pairs between two cells: the boxes of either that reach the other's bounds, taken one by one from
// the side that has fewer of them.
inline void cellAgainstCell(const TreeView& tree_a, std::size_t a, const TreeView& tree_b,
                            std::size_t b, bool exact, PairSink& sink) {
  const Side side_a = sideOf(tree_a, a), side_b = sideOf(tree_b, b);
  unsigned from_a = overlaps(tree_b.levels[1][b / group_size], b % group_size, *side_a.boxes);
  if (!from_a) return;
  unsigned from_b = overlaps(tree_a.levels[1][a / group_size], a % group_size, *side_b.boxes);
  if (!from_b) return;
  makeRoom(sink);
  if (__builtin_popcount(from_a) <= __builtin_popcount(from_b))
    for (; from_a; from_a &= from_a - 1)
      boxAgainstCell(side_a, __builtin_ctz(from_a), side_b, from_b, exact, sink);
  else
    for (; from_b; from_b &= from_b - 1)
      boxAgainstCell(side_b, __builtin_ctz(from_b), side_a, from_a, exact, sink);
}

// Calls visit(cell) for the cells of `tree`, from `first` on, whose bounds overlap box `lane` of
// `query`.
template <class Visit>
inline void forOverlappingCells(const TreeView& tree, const Group& query, unsigned lane,
                                std::size_t first, Visit visit) {
  struct Node {
    std::uint32_t level, group;
  };
  // A node leaves at most 15 siblings a level behind on the stack.
  Node stack[TreeView::max_levels * group_size];
  int top = 0;
  stack[top++] = {static_cast<std::uint32_t>(tree.depth - 1), 0};
  while (top) {
    const Node node = stack[--top];
    unsigned mask = overlaps(query, lane, tree.levels[node.level][node.group]);
    const std::size_t base = std::size_t{node.group} * group_size;
    const std::size_t from = first >> 4 * (node.level - 1);
    if (from > base) mask = from - base < group_size ? mask >> (from - base) << (from - base) : 0;
    for (; mask; mask &= mask - 1) {
      const std::uint32_t child = static_cast<std::uint32_t>(base + __builtin_ctz(mask));
      if (node.level == 1)
        visit(child);
      else
        stack[top++] = {node.level - 1, child};
    }
  }
}

void selfPairs(const TreeView& tree, std::size_t begin, std::size_t end, bool exact,
               PairSink& sink) {
  for (std::size_t cell = begin; cell < end; ++cell) {
    cellAgainstItself(sideOf(tree, cell), exact, sink);
    forOverlappingCells(
        tree, tree.levels[1][cell / group_size], cell % group_size, cell + 1,
        [&](std::size_t other) { cellAgainstCell(tree, cell, tree, other, exact, sink); });
  }
}

void crossPairs(const TreeView& queries, std::size_t begin, std::size_t end, const TreeView& tree,
                bool exact, PairSink& sink) {
  for (std::size_t cell = begin; cell < end; ++cell)
    forOverlappingCells(
        tree, queries.levels[1][cell / group_size], cell % group_size, 0,
        [&](std::size_t other) { cellAgainstCell(queries, cell, tree, other, exact, sink); });
}

void rowPairs(const TreeView& cells, std::size_t row, std::size_t begin, std::size_t end,
              bool exact, PairSink& sink) {
  const Side side = sideOf(cells, row / group_size);
  const unsigned lane = row % group_size;
  for (std::size_t cell = begin / group_size; cell * group_size < end; ++cell) {
    unsigned candidates = all_lanes;
    if (cell == begin / group_size) candidates = candidates << begin % group_size & all_lanes;
    if (end - cell * group_size < group_size) candidates &= (1u << (end - cell * group_size)) - 1;
    if (sink.end - sink.next < group_size) sink.grow(sink, group_size);
    boxAgainstCell(side, lane, sideOf(cells, cell), candidates, exact, sink);
  }
}

void packCells(const Box* boxes, const std::uint32_t* order, std::size_t count, std::size_t begin,
               std::size_t end, Group* cells, GroupIds* ids) {
  const float nan = __builtin_nanf("");
  for (std::size_t cell = begin; cell < end; ++cell)
    for (int lane = 0; lane < group_size; ++lane) {
      const std::size_t place = cell * group_size + lane;
      const bool used = place < count;
      const std::uint32_t slot = !used   ? 0
                                 : order ? order[place]
                                         : static_cast<std::uint32_t>(place);
      ids[cell].slot[lane] = slot;
      for (int axis = 0; axis < 3; ++axis) {
        cells[cell].lower[axis][lane] = used ? boxes[slot].lower[axis] : nan;
        cells[cell].upper[axis][lane] = used ? boxes[slot].upper[axis] : nan;
      }
    }
}

void packBounds(const Group* children, std::size_t count, std::size_t begin, std::size_t end,
                Group* parents) {
  const float nan = __builtin_nanf("");
  for (std::size_t parent = begin; parent < end; ++parent)
    for (int lane = 0; lane < group_size; ++lane) {
      const std::size_t child = parent * group_size + lane;
      for (int axis = 0; axis < 3; ++axis) {
        parents[parent].lower[axis][lane] =
            child < count ? Lanes::least(children[child].lower[axis]) : nan;
        parents[parent].upper[axis][lane] =
            child < count ? Lanes::greatest(children[child].upper[axis]) : nan;
      }
    }
}

constexpr Kernels kernel_table = {Lanes::name, packCells,  packBounds,
                                  selfPairs,   crossPairs, rowPairs};

}  // namespace

#endif
