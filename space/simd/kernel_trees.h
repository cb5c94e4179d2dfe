// Pairs and boxes that are found by walking a tree over cells. Internal linkage, as in
// kernels_impl.h.
#pragma once

#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/simd/kernel_overlaps.h"

namespace {

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
    if (from > base) mask &= from - base < group_size ? ~0u << (from - base) : 0;
    for (; mask; mask &= mask - 1)
      stack[top++] = {node.level - 1, static_cast<std::uint32_t>(base + __builtin_ctz(mask))};
  }
}

// Writes the words of the boxes of a cell that overlap box 0 of `box`; returns what comes after.
template <class Real>
inline std::uint32_t* meetCell(const Group<Real>& box, const Group<Real>& boxes,
                               std::uint32_t* found) {
  const auto all = [](unsigned hits) { return hits; };
  return found + meetBoxes(box, 0, boxes, all, found);
}

// Meets many cells at a time, so that a processor need not know what is in one to read the next.
template <class Real>
std::size_t findInTree(const TreeView<Real>& tree, const Group<Real>& box, std::uint32_t* found) {
  std::uint32_t cells[gathered_nodes + group_size];
  std::size_t count = 0;
  std::uint32_t* next = found;
  const auto meet = [&] {
    for (std::size_t i = 0; i < count; ++i) next = meetCell(box, tree.levels[0][cells[i]], next);
    count = 0;
  };
  forOverlappingNodes(tree, box, 0, 0, [&](std::uint32_t node, unsigned mask) {
    Lanes::writeNumbers(node * group_size, mask, cells + count);
    count += __builtin_popcount(mask);
    if (count >= gathered_nodes) meet();
  });
  meet();
  return next - found;
}

template <class Real>
std::size_t findInCells(const Group<Real>* cells, std::size_t count, const Group<Real>& box,
                        std::uint32_t* found) {
  std::uint32_t* next = found;
  for (std::size_t cell = 0; cell < count; ++cell) next = meetCell(box, cells[cell], next);
  return next - found;
}

}  // namespace
