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

template <class Real>
using Row = Lanes::Row<Real>;

template <class Real>
inline Row<Real> rowOf(const Group<Real>& boxes) {
  return Row<Real>(boxes.lower[0], boxes.upper[0], group_size);
}

// Which of sixteen boxes overlap box `lane` of `box`. NaN overlaps nothing. The formula holds for
// inverted boxes too, and so do bounds made of least and greatest ones.
template <class Real>
inline unsigned overlaps(const Group<Real>& box, unsigned lane, const Group<Real>& boxes) {
  return rowOf(boxes).overlapping(box, lane);
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

// What goes with the boxes of a row; without filters the last three are null.
struct RowIds {
  const std::uint32_t *slot, *category, *collide, *body;
};

// Pairs of box `lane` of `query` with those of sixteen boxes that are in `mask`.
template <class Real>
inline void boxAgainstRow(const Query<Real>& query, unsigned lane, unsigned mask,
                          const Row<Real>& row, const RowIds& ids, PairSink& sink) {
  unsigned hits = row.overlapping(*query.boxes, lane) & mask;
  if (!hits) return;
  if (query.filter) {
    hits &= passesFilter(*query.filter, lane, ids.category, ids.collide, ids.body);
    if (!hits) return;
  }
  std::uint64_t* const first = sink.next;
  sink.next += Lanes::writePairs(ids.slot, query.ids->slot[lane], hits, first);
  if (sizeof(Real) > sizeof(float) || query.exact) return;
  const unsigned unsure = hits & ~row.overlapping(query.inner, lane);
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
    const Row<Real> row(others.lower[0] + base, others.upper[0] + base, Candidates<Real>::stride);
    const RowIds ids = {others.slot + base, others.category + base, others.collide + base,
                        others.body + base};
    for (unsigned lane = 0; lane < query.count; ++lane)
      boxAgainstRow(query, lane, all_lanes, row, ids, sink);
  }
  others.count = 0;
}

template <class Real>
inline RowIds idsOf(const TreeView<Real>& tree, std::size_t cell) {
  if (!tree.filters) return {tree.ids[cell].slot, nullptr, nullptr, nullptr};
  const GroupFilter& filter = tree.filters[cell];
  return {tree.ids[cell].slot, filter.category, filter.collide, filter.body};
}

// Cells, gathered in the same way: their bounds and numbers.
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

  // Adds the cells in `mask` of the sixteen whose bounds are `bounds` and whose numbers are
  // `cells`.
  void add(const Group<Real>& bounds, const std::uint32_t* cells, unsigned mask) {
    for (int axis = 0; axis < 3; ++axis) {
      Lanes::compress(bounds.lower[axis], mask, lower[axis] + count);
      Lanes::compress(bounds.upper[axis], mask, upper[axis] + count);
    }
    Lanes::compress(cells, mask, cell + count);
    count += __builtin_popcount(mask);
  }

  // Puts the cells from `first` on whose bounds overlap box `lane` of `box` into chosen[], and
  // returns their number.
  std::size_t choose(const Group<Real>& box, unsigned lane, std::uint32_t first) {
    for (int i = 0; i < group_size; ++i)
      lower[0][count + i] = static_cast<Real>(__builtin_nanf(""));
    std::size_t number = 0;
    for (std::size_t base = 0; base < count; base += group_size) {
      const unsigned mask =
          Row<Real>(lower[0] + base, upper[0] + base, stride).overlapping(box, lane) &
          ~Lanes::below(cell + base, first);
      Lanes::compress(cell + base, mask, chosen + number);
      number += __builtin_popcount(mask);
    }
    return number;
  }
};

// Calls visit(node, mask) for the nodes just above the cells of `tree`, from that of cell `first`
// on: `mask` tells which of its sixteen cells have bounds that overlap box `lane` of `box`.
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

// Where a thread gathers.
template <class Real>
struct Workplace {
  CellCandidates<Real> cells;
  Candidates<Real> boxes;
};

// Pairs of the cells [begin, end) of `queries`, which are all below one node, with the gathered
// cells of `tree`; with those after the cell itself only, if `forward`. Uses the gathered cells up.
template <class Real>
inline void meetCells(const TreeView<Real>& queries, std::size_t begin, std::size_t end,
                      const TreeView<Real>& tree, bool forward, bool exact, Workplace<Real>& work,
                      PairSink& sink) {
  for (std::size_t cell = begin; cell < end; ++cell) {
    const Group<Real>& bounds = queries.levels[1][cell / group_size];
    const unsigned lane = cell % group_size;
    const std::size_t others =
        work.cells.choose(bounds, lane, forward ? static_cast<std::uint32_t>(cell + 1) : 0);
    if (!others) continue;
    const Query<Real> query(queries, cell, exact);
    for (std::size_t i = 0; i < others; ++i) {
      const std::size_t other = work.cells.chosen[i];
      work.boxes.add(tree, other, overlaps(bounds, lane, tree.levels[0][other]));
      if (work.boxes.full()) meetCandidates(query, work.boxes, sink);
    }
    meetCandidates(query, work.boxes, sink);
  }
  work.cells.count = 0;
}

// Pairs of the cells [begin, end) of `queries` with those of `tree`. The tree is walked once for
// all cells below one node, then each of them chooses among what was found.
template <class Real>
inline void cellsAgainstTree(const TreeView<Real>& queries, std::size_t begin, std::size_t end,
                             const TreeView<Real>& tree, bool forward, bool exact, PairSink& sink) {
  Workplace<Real> work;
  alignas(64) std::uint32_t numbers[group_size];
  while (begin < end) {
    const std::size_t node = begin / group_size;
    const std::size_t node_end = (node + 1) * group_size, stop = node_end < end ? node_end : end;
    // The bounds of all cells below the node.
    Group<Real> bounds;
    const Group<Real>& cells = queries.levels[1][node];
    for (int axis = 0; axis < 3; ++axis) {
      bounds.lower[axis][0] = Lanes::least(cells.lower[axis]);
      bounds.upper[axis][0] = Lanes::greatest(cells.upper[axis]);
    }
    forOverlappingNodes(tree, bounds, 0, forward ? begin : 0,
                        [&](std::uint32_t group, unsigned mask) {
                          for (std::uint32_t i = 0; i < group_size; ++i)
                            numbers[i] = group * group_size + i;
                          work.cells.add(tree.levels[1][group], numbers, mask);
                          if (work.cells.full())
                            meetCells(queries, begin, stop, tree, forward, exact, work, sink);
                        });
    meetCells(queries, begin, stop, tree, forward, exact, work, sink);
    begin = stop;
  }
}

template <class Real>
void selfPairs(const TreeView<Real>& tree, std::size_t begin, std::size_t end, bool exact,
               PairSink& sink) {
  for (std::size_t cell = begin; cell < end; ++cell) {
    const Query<Real> query(tree, cell, exact);
    makeRoom(sink, group_size * group_size);
    const Row<Real> row = rowOf(tree.levels[0][cell]);
    const RowIds ids = idsOf(tree, cell);
    for (unsigned lane = 0; lane + 1 < query.count; ++lane)
      boxAgainstRow(query, lane, all_lanes << (lane + 1) & all_lanes, row, ids, sink);
  }
  cellsAgainstTree(tree, begin, end, tree, true, exact, sink);
}

template <class Real>
void crossPairs(const TreeView<Real>& queries, std::size_t begin, std::size_t end,
                const TreeView<Real>& tree, bool exact, PairSink& sink) {
  cellsAgainstTree(queries, begin, end, tree, false, exact, sink);
}

// A box of a query cell, and a cell that its bounds reach.
struct Meeting {
  std::uint32_t cell;
  std::uint32_t lane;
};

template <class Real>
inline void prefetchCell(const TreeView<Real>& tree, std::size_t cell) {
  const char* const boxes = reinterpret_cast<const char*>(tree.levels[0] + cell);
  for (std::size_t line = 0; line < sizeof(Group<Real>); line += 64)
    __builtin_prefetch(boxes + line);
  __builtin_prefetch(tree.ids + cell);
}

// The tree is walked for all boxes of a query cell before the cells it leads to are read, so that
// these are on their way from memory meanwhile.
template <class Real>
void boxPairs(const TreeView<Real>& queries, std::size_t begin, std::size_t end,
              const TreeView<Real>& tree, bool exact, PairSink& sink) {
  constexpr std::size_t capacity = 256;
  Meeting meetings[capacity + group_size];
  for (std::size_t cell = begin; cell < end; ++cell) {
    const Query<Real> query(queries, cell, exact);
    std::size_t count = 0;
    const auto meetAll = [&] {
      for (std::size_t i = 0; i < count; ++i) {
        makeRoom(sink, group_size);
        const std::size_t other = meetings[i].cell;
        boxAgainstRow(query, meetings[i].lane, all_lanes, rowOf(tree.levels[0][other]),
                      idsOf(tree, other), sink);
      }
      count = 0;
    };
    for (unsigned lane = 0; lane < query.count; ++lane)
      forOverlappingNodes(tree, *query.boxes, lane, 0, [&](std::uint32_t node, unsigned mask) {
        for (; mask; mask &= mask - 1) {
          const std::uint32_t other = node * group_size + __builtin_ctz(mask);
          prefetchCell(tree, other);
          meetings[count++] = {other, lane};
        }
        if (count >= capacity) meetAll();
      });
    meetAll();
  }
}

template <class Real>
void reachPairs(const TreeView<Real>& queries, const TreeView<Real>& tree, std::size_t begin,
                std::size_t end, bool exact, PairSink& sink) {
  for (std::size_t query_cell = 0; query_cell < queries.groups[0]; ++query_cell) {
    const Query<Real> query(queries, query_cell, exact);
    for (std::size_t first = begin; first < end; first += group_size) {
      const Group<Real>& bounds = tree.levels[1][first / group_size];
      const unsigned inside = end - first < group_size ? (1u << (end - first)) - 1 : all_lanes;
      for (unsigned lane = 0; lane < query.count; ++lane)
        for (unsigned mask = overlaps(*query.boxes, lane, bounds) & inside; mask;
             mask &= mask - 1) {
          const std::size_t cell = first + __builtin_ctz(mask);
          makeRoom(sink, group_size);
          boxAgainstRow(query, lane, all_lanes, rowOf(tree.levels[0][cell]), idsOf(tree, cell),
                        sink);
        }
    }
  }
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
        boxAgainstRow(query, row % group_size, mask, rowOf(cells.levels[0][cell]),
                      idsOf(cells, cell), sink);
      }
    }
  }
}

template <class Real>
std::size_t findInTree(const TreeView<Real>& tree, const Group<Real>& box, std::uint32_t* found) {
  std::uint32_t* next = found;
  forOverlappingNodes(tree, box, 0, 0, [&](std::uint32_t node, unsigned mask) {
    for (; mask; mask &= mask - 1) {
      const std::size_t cell = std::size_t{node} * group_size + __builtin_ctz(mask);
      const unsigned hits = overlaps(box, 0, tree.levels[0][cell]);
      Lanes::compress(tree.ids[cell].slot, hits, next);
      next += __builtin_popcount(hits);
    }
  });
  return next - found;
}

template <class Real>
std::size_t findInCells(const Group<Real>* cells, const GroupIds* ids, std::size_t count,
                        const Group<Real>& box, std::uint32_t* found) {
  std::uint32_t* next = found;
  for (std::size_t cell = 0; cell < count; ++cell) {
    const unsigned hits = overlaps(box, 0, cells[cell]);
    if (!hits) continue;
    Lanes::compress(ids[cell].slot, hits, next);
    next += __builtin_popcount(hits);
  }
  return next - found;
}

// Sixteen boxes and, on each axis, the greatest size of their bounds.
template <class Real>
struct SizedGroup {
  Group<Real> boxes;
  double size[3];

  SizedGroup(const BasicBox<Real>* first, std::size_t count) {
    const Real nan = static_cast<Real>(__builtin_nanf(""));
    for (int axis = 0; axis < 3; ++axis) {
      Real *const lower = boxes.lower[axis], *const upper = boxes.upper[axis];
      for (std::size_t lane = 0; lane < group_size; ++lane) {
        lower[lane] = lane < count ? first[lane].lower[axis] : nan;
        upper[lane] = lane < count ? first[lane].upper[axis] : nan;
      }
      size[axis] = 0;
      for (const Real bound : {Lanes::least(lower), Lanes::greatest(lower), Lanes::least(upper),
                               Lanes::greatest(upper)})
        if (__builtin_fabs(bound) > size[axis]) size[axis] = __builtin_fabs(bound);
    }
  }
};

// Which of the boxes may reach a half-space, and which of them surely do. The corner deepest in it
// is at lower bounds where the normal points up. All stay undecided where a sum could overflow, and
// boxes whose depth is NaN.
template <class Real>
inline HalfSpaceHits meetHalfSpace(const SizedGroup<Real>& group, const HalfSpace<Real>& plane) {
  double size = __builtin_fabs(plane.distance);
  const Real* corner[3];
  for (int axis = 0; axis < 3; ++axis) {
    corner[axis] = plane.normal[axis] > 0 ? group.boxes.lower[axis] : group.boxes.upper[axis];
    if (plane.normal[axis] != 0) size += __builtin_fabs(plane.normal[axis]) * group.size[axis];
  }
  alignas(64) Real depth[group_size];
  for (int lane = 0; lane < group_size; ++lane)
    depth[lane] = plane.normal[0] * corner[0][lane] + plane.normal[1] * corner[1][lane] +
                  plane.normal[2] * corner[2][lane];
  HalfSpaceHits hits = {0, 0, all_lanes, 0};
  const double margin = plane.rounding * size;
  if (!(size + margin < (sizeof(Real) > sizeof(float) ? __DBL_MAX__ : __FLT_MAX__) / 4))
    return hits;
  hits.maybe &= ~Lanes::atLeast(depth, static_cast<Real>(plane.distance + margin));
  hits.sure = hits.maybe & Lanes::atMost(depth, static_cast<Real>(plane.distance - margin));
  return hits;
}

template <class Real>
std::size_t meetHalfSpaces(const BasicBox<Real>* boxes, std::size_t size, std::size_t begin,
                           std::size_t end, const HalfSpace<Real>* planes, std::size_t count,
                           HalfSpaceHits* hits) {
  HalfSpaceHits* next = hits;
  for (std::size_t cell = begin; cell < end; ++cell) {
    const std::size_t first = cell * group_size;
    const SizedGroup<Real> group(boxes + first,
                                 size - first < group_size ? size - first : group_size);
    const unsigned active =
        Lanes::atMost(group.boxes.lower[0], static_cast<Real>(__builtin_inff()));
    for (std::size_t plane = 0; plane < count; ++plane) {
      HalfSpaceHits found = meetHalfSpace(group, planes[plane]);
      found.maybe &= active;
      if (!found.maybe) continue;
      found.sure &= active;
      found.plane = static_cast<std::uint32_t>(plane);
      found.cell = static_cast<std::uint32_t>(cell);
      *next++ = found;
    }
  }
  return next - hits;
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
  return {packCells<Real>,   packBounds<Real>,    selfPairs<Real>,     crossPairs<Real>,
          boxPairs<Real>,    reachPairs<Real>,    trianglePairs<Real>, findInTree<Real>,
          findInCells<Real>, meetHalfSpaces<Real>};
}

constexpr KernelSet kernel_set = {Lanes::name, kernelsFor<float>(), kernelsFor<double>(),
                                  sortLists};

}  // namespace

#endif
