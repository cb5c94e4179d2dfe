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

// Which of sixteen boxes overlap box `lane` of `box`, as closed intervals. NaN overlaps nothing.
// The formula holds for inverted boxes too, and so do bounds made of least and greatest ones. The
// bounds on each axis are `stride` numbers apart.
template <class Real>
inline unsigned overlaps(const Group<Real>& box, unsigned lane, const Real* lower,
                         const Real* upper, std::size_t stride) {
  return Lanes::atLeast(upper, box.lower[0][lane]) & Lanes::atMost(lower, box.upper[0][lane]) &
         Lanes::atLeast(upper + stride, box.lower[1][lane]) &
         Lanes::atMost(lower + stride, box.upper[1][lane]) &
         Lanes::atLeast(upper + 2 * stride, box.lower[2][lane]) &
         Lanes::atMost(lower + 2 * stride, box.upper[2][lane]);
}

template <class Real>
inline unsigned overlaps(const Group<Real>& box, unsigned lane, const Group<Real>& boxes) {
  return overlaps(box, lane, boxes.lower[0], boxes.upper[0], group_size);
}

// Two steps toward `direction` (1 up, -1 down) in the order of all floats, of which the two zeros
// are one; NaN beyond infinity.
inline float twoSteps(float value, int direction) {
  std::int32_t bits;
  memcpy(&bits, &value, sizeof bits);
  std::int32_t sign = bits >> 31;
  std::int32_t order = ((bits & 0x7fffffff) ^ sign) - sign + 2 * direction;
  sign = order >> 31;
  bits = ((order ^ sign) - sign) | (sign & std::int32_t{-0x7fffffff - 1});
  memcpy(&value, &bits, sizeof bits);
  return value;
}

// The boxes of a cell, shrunk so far that a shrunk box can only overlap another box's float bounds
// if the exact boxes overlap: an exact bound is less than one step inside its float bound, for
// both.
inline void shrink(const Group<float>& cell, Group<float>& inner) {
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < group_size; ++i) {
      inner.lower[axis][i] = twoSteps(cell.lower[axis][i], 1);
      inner.upper[axis][i] = twoSteps(cell.upper[axis][i], -1);
    }
}

// Boxes of doubles are always exact.
inline void shrink(const Group<double>&, Group<double>&) {}

// Which of sixteen boxes may meet box `lane` by their bits and bodies.
inline unsigned passesFilter(const GroupFilter& filter, unsigned lane,
                             const std::uint32_t* category, const std::uint32_t* collide,
                             const std::uint32_t* body) {
  const unsigned wanted = Lanes::sharesBits(collide, filter.category[lane]) |
                          Lanes::sharesBits(category, filter.collide[lane]);
  return filter.body[lane] ? wanted & ~Lanes::equals(body, filter.body[lane]) : wanted;
}

inline void markUnsure(std::uint64_t* pair, unsigned hits, unsigned unsure) {
  for (; hits; hits &= hits - 1, ++pair)
    if (unsure & hits & (0u - hits)) *pair |= std::uint64_t{1} << 63;
}

// The cell whose boxes are taken one by one.
template <class Real>
struct Query {
  const Group<Real>* boxes;
  const GroupIds* ids;
  const GroupFilter* filter;  // null: no pair is filtered
  Group<Real> inner;          // the boxes shrunk, unless they are exact
  unsigned count;             // boxes in use; the others are NaN
  bool exact;

  Query(const TreeView<Real>& tree, std::size_t cell, bool exact)
      : boxes(tree.levels[0] + cell),
        ids(tree.ids + cell),
        filter(tree.filters ? tree.filters + cell : nullptr),
        count(__builtin_popcount(
            Lanes::atMost(boxes->lower[0], static_cast<Real>(__builtin_inff())))),
        exact(exact) {
    if (!exact) shrink(*boxes, inner);
  }
};

// Boxes that the query's bounds reach, gathered so that the query's boxes meet sixteen of them at a
// time.
template <class Real>
struct Candidates {
  static constexpr std::size_t capacity = 2048 / sizeof(Real);
  static constexpr std::size_t stride = capacity + group_size;

  alignas(64) Real lower[3][stride];
  alignas(64) Real upper[3][stride];
  alignas(64) std::uint32_t slot[stride];
  alignas(64) std::uint32_t category[stride], collide[stride], body[stride];
  std::size_t count = 0;

  bool full() const { return count > capacity - group_size; }

  // Adds the boxes of `cell` in `mask`; at most 16 places are written beyond `count`.
  void add(const TreeView<Real>& tree, std::size_t cell, unsigned mask) {
    const Group<Real>& boxes = tree.levels[0][cell];
    for (int axis = 0; axis < 3; ++axis) {
      Lanes::compress(boxes.lower[axis], mask, lower[axis] + count);
      Lanes::compress(boxes.upper[axis], mask, upper[axis] + count);
    }
    Lanes::compress(tree.ids[cell].slot, mask, slot + count);
    if (tree.filters) {
      const GroupFilter& filter = tree.filters[cell];
      Lanes::compress(filter.category, mask, category + count);
      Lanes::compress(filter.collide, mask, collide + count);
      Lanes::compress(filter.body, mask, body + count);
    }
    count += __builtin_popcount(mask);
  }
};

// Pairs of box `lane` of `query` with those of sixteen boxes that are in `mask`.
template <class Real>
inline void boxAgainstSixteen(const Query<Real>& query, unsigned lane, unsigned mask,
                              const Real* lower, const Real* upper, std::size_t stride,
                              const std::uint32_t* slots, const std::uint32_t* category,
                              const std::uint32_t* collide, const std::uint32_t* body,
                              PairSink& sink) {
  unsigned hits = overlaps(*query.boxes, lane, lower, upper, stride) & mask;
  if (!hits) return;
  if (query.filter) {
    hits &= passesFilter(*query.filter, lane, category, collide, body);
    if (!hits) return;
  }
  std::uint64_t* const first = sink.next;
  sink.next += Lanes::writePairs(slots, query.ids->slot[lane], hits, first);
  if (sizeof(Real) > sizeof(float) || query.exact) return;
  const unsigned unsure = hits & ~overlaps(query.inner, lane, lower, upper, stride);
  if (unsure) markUnsure(first, hits, unsure);
}

inline void makeRoom(PairSink& sink, std::size_t room) {
  if (static_cast<std::size_t>(sink.end - sink.next) < room) sink.grow(sink, room);
}

// Pairs of the query's boxes with all candidates, which are used up.
template <class Real>
inline void meetCandidates(const Query<Real>& query, Candidates<Real>& others, PairSink& sink) {
  if (!others.count) return;
  const Real nan = static_cast<Real>(__builtin_nanf(""));
  for (std::size_t i = 0; i < group_size; ++i) others.lower[0][others.count + i] = nan;
  for (std::size_t base = 0; base < others.count; base += group_size) {
    makeRoom(sink, group_size * group_size);
    for (unsigned lane = 0; lane < query.count; ++lane)
      boxAgainstSixteen(query, lane, all_lanes, others.lower[0] + base, others.upper[0] + base,
                        Candidates<Real>::stride, others.slot + base, others.category + base,
                        others.collide + base, others.body + base, sink);
  }
  others.count = 0;
}

// Pairs of box `lane` of `query` with those of one cell of `tree` that are in `mask`.
template <class Real>
inline void boxAgainstCell(const Query<Real>& query, unsigned lane, unsigned mask,
                           const TreeView<Real>& tree, std::size_t cell, PairSink& sink) {
  const Group<Real>& boxes = tree.levels[0][cell];
  const GroupFilter* const filter = tree.filters ? tree.filters + cell : nullptr;
  boxAgainstSixteen(query, lane, mask, boxes.lower[0], boxes.upper[0], group_size,
                    tree.ids[cell].slot, filter ? filter->category : nullptr,
                    filter ? filter->collide : nullptr, filter ? filter->body : nullptr, sink);
}

// Calls visit(cell, mask) for the cells of `tree`, from `first` on, that have boxes overlapping box
// `lane` of `query`; `mask` tells which.
template <class Real, class Visit>
inline void forOverlappingBoxes(const TreeView<Real>& tree, const Group<Real>& query, unsigned lane,
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
    unsigned mask = overlaps(query, lane, tree.levels[node.level][node.group]);
    const std::size_t base = std::size_t{node.group} * group_size;
    const std::size_t from = first >> 4 * (node.level - 1);
    if (from > base) mask = from - base < group_size ? mask >> (from - base) << (from - base) : 0;
    if (node.level == 1) {
      for (; mask; mask &= mask - 1) {
        const std::size_t cell = base + __builtin_ctz(mask);
        visit(cell, overlaps(query, lane, tree.levels[0][cell]));
      }
    } else {
      for (; mask; mask &= mask - 1)
        stack[top++] = {node.level - 1, static_cast<std::uint32_t>(base + __builtin_ctz(mask))};
    }
  }
}

// Pairs of the boxes of `query`, cell `cell` of `queries`, with the cells from `first` on of
// `tree`.
template <class Real>
inline void cellAgainstTree(const Query<Real>& query, const TreeView<Real>& queries,
                            std::size_t cell, const TreeView<Real>& tree, std::size_t first,
                            Candidates<Real>& candidates, PairSink& sink) {
  forOverlappingBoxes(tree, queries.levels[1][cell / group_size], cell % group_size, first,
                      [&](std::size_t other, unsigned mask) {
                        candidates.add(tree, other, mask);
                        if (candidates.full()) meetCandidates(query, candidates, sink);
                      });
  meetCandidates(query, candidates, sink);
}

template <class Real>
void selfPairs(const TreeView<Real>& tree, std::size_t begin, std::size_t end, bool exact,
               PairSink& sink) {
  Candidates<Real> candidates;
  for (std::size_t cell = begin; cell < end; ++cell) {
    const Query<Real> query(tree, cell, exact);
    makeRoom(sink, group_size * group_size);
    for (unsigned lane = 0; lane + 1 < query.count; ++lane)
      boxAgainstCell(query, lane, all_lanes << (lane + 1) & all_lanes, tree, cell, sink);
    cellAgainstTree(query, tree, cell, tree, cell + 1, candidates, sink);
  }
}

template <class Real>
void crossPairs(const TreeView<Real>& queries, std::size_t begin, std::size_t end,
                const TreeView<Real>& tree, bool exact, PairSink& sink) {
  Candidates<Real> candidates;
  for (std::size_t cell = begin; cell < end; ++cell)
    cellAgainstTree(Query<Real>(queries, cell, exact), queries, cell, tree, 0, candidates, sink);
}

template <class Real>
void trianglePairs(const TreeView<Real>& cells, const TrianglePart& part, bool exact,
                   PairSink& sink) {
  for (std::size_t row = part.first_row; row <= part.last_row;) {
    const std::size_t query_cell = row / group_size;
    const Query<Real> query(cells, query_cell, exact);
    for (; row <= part.last_row && row / group_size == query_cell; ++row) {
      const std::size_t begin = row == part.first_row ? part.first_column : row + 1;
      const std::size_t end = row == part.last_row ? part.last_column : part.places;
      makeRoom(sink, end > begin ? end - begin + group_size : 0);
      for (std::size_t cell = begin / group_size; cell * group_size < end; ++cell) {
        const std::size_t base = cell * group_size;
        unsigned mask = all_lanes;
        if (base < begin) mask = mask << (begin - base) & all_lanes;
        if (end - base < group_size) mask &= (1u << (end - base)) - 1;
        boxAgainstCell(query, row % group_size, mask, cells, cell, sink);
      }
    }
  }
}

template <class Real>
void packCells(const BasicBox<Real>* boxes, const std::uint32_t* order, const std::uint32_t* starts,
               std::size_t begin, std::size_t end, Group<Real>* cells, GroupIds* ids) {
  const Real nan = static_cast<Real>(__builtin_nanf(""));
  for (std::size_t cell = begin; cell < end; ++cell) {
    const std::uint32_t start = starts[cell], count = starts[cell + 1] - start;
    for (std::uint32_t lane = 0; lane < group_size; ++lane) {
      const bool used = lane < count;
      const std::uint32_t slot = !used ? 0 : order ? order[start + lane] : start + lane;
      ids[cell].slot[lane] = slot;
      for (int axis = 0; axis < 3; ++axis) {
        cells[cell].lower[axis][lane] = used ? boxes[slot].lower[axis] : nan;
        cells[cell].upper[axis][lane] = used ? boxes[slot].upper[axis] : nan;
      }
    }
  }
}

template <class Real>
void packBounds(const Group<Real>* children, std::size_t count, std::size_t begin, std::size_t end,
                Group<Real>* parents) {
  const Real nan = static_cast<Real>(__builtin_nanf(""));
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

// A pair's place in its list is the number of pairs below it: no comparison decides where to go
// next, so none can be guessed wrong by the processor.
void sortLists(const std::uint64_t* pairs, const std::uint32_t* ends, std::size_t lists,
               std::uint64_t* sorted, void (*sortLong)(std::uint64_t* begin, std::uint64_t* end)) {
  alignas(64) std::uint32_t keys[group_size];
  for (std::size_t list = 0, begin = 0; list < lists; ++list) {
    const std::size_t end = ends[list], count = end - begin;
    if (count > group_size) {
      memcpy(sorted + begin, pairs + begin, count * sizeof *pairs);
      sortLong(sorted + begin, sorted + end);
    } else if (count) {
      for (std::size_t i = 0; i < group_size; ++i) keys[i] = 0x7fffffff;
      for (std::size_t i = 0; i < count; ++i)
        keys[i] = static_cast<std::uint32_t>(pairs[begin + i]) & 0x7fffffff;
      for (std::size_t i = 0; i < count; ++i)
        sorted[begin + __builtin_popcount(Lanes::below(keys, keys[i]))] = pairs[begin + i];
    }
    begin = end;
  }
}

template <class Real>
constexpr Kernels<Real> kernelsFor() {
  return {packCells<Real>, packBounds<Real>, selfPairs<Real>, crossPairs<Real>,
          trianglePairs<Real>};
}

constexpr KernelSet kernel_set = {Lanes::name, kernelsFor<float>(), kernelsFor<double>(),
                                  sortLists};

}  // namespace

#endif
