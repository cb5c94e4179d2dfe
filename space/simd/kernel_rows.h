// The rows of boxes: their partners of greater slots, found, put in order and made pairs. Internal
// linkage, as in kernels_impl.h.
#pragma once

#include <string.h>

#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/simd/kernel_trees.h"
#include "space/simd/row_order.h"

namespace {

// Cells that may meet those below a node, in a thread's space.
template <class Real>
struct NearCells {
  RowSpace<Real>& space;
  std::size_t count = 0;

  // Bounds that Sixteen reads a lane of.
  struct Bounds {
    const Real *lower[3], *upper[3];
  };
  Bounds bounds() const {
    const Real* const from = space.bounds;
    const std::size_t step = space.stride;
    return {{from, from + step, from + 2 * step},
            {from + 3 * step, from + 4 * step, from + 5 * step}};
  }
  // Adds those in `mask` of the sixteen cells that a node has the bounds of.
  void add(const Group<Real>& node, std::uint32_t first_cell, unsigned mask) {
    if (count + 2 * group_size > space.stride) space.growNear(count + 2 * group_size);
    Real* const to = space.bounds + count;
    for (int axis = 0; axis < 3; ++axis) {
      Lanes::compress(node.lower[axis], mask, to + axis * space.stride);
      Lanes::compress(node.upper[axis], mask, to + (3 + axis) * space.stride);
    }
    Lanes::compress(node.slot, mask, space.greatest + count);
    Lanes::writeNumbers(first_cell, mask, space.cell + count);
    count += __builtin_popcount(mask);
  }
  // Beyond the last one there is room for sixteen, which overlap nothing.
  void close() {
    if (count + group_size > space.stride) space.growNear(count + group_size);
    for (int i = 0; i < group_size; ++i)
      space.bounds[count + i] = static_cast<Real>(__builtin_nanf(""));
    for (int i = 0; i < group_size; ++i) space.greatest[count + i] = 0;
  }
  // Leaves in space.chosen the places of those that overlap box `lane` of `box` and have a slot
  // above `least`; returns their number.
  std::size_t choose(const Group<Real>& box, unsigned lane, std::uint32_t least) const {
    std::size_t number = 0;
    for (std::size_t at = 0; at < count; at += group_size) {
      const unsigned mask =
          Sixteen<Real>{space.bounds + at, space.bounds + 3 * space.stride + at, space.stride}
              .overlapping(box, lane) &
          ~Lanes::below(space.greatest + at, least + 1);
      Lanes::writeNumbers(static_cast<std::uint32_t>(at), mask, space.chosen + number);
      number += __builtin_popcount(mask);
    }
    return number;
  }
};

// A cell, and `chosen` near ones that it may meet. By value: what is written to rows could, for all
// that a compiler knows, change what is pointed to.
template <class Real>
struct CellAmongNear {
  const Group<Real>* cells;  // of all trees
  const GroupFilter* filters;
  std::size_t cell;
  typename NearCells<Real>::Bounds bounds;
  const std::uint32_t *greatest, *number;  // of near cells
  const std::uint32_t* chosen;
  std::size_t chosen_count;

  const Group<Real>& boxes() const { return cells[cell]; }
  // For each chosen cell and box in `lanes` that may have pairs in it writes a code: sixteen times
  // the cell, plus the lane. Returns the number of codes.
  std::size_t list(unsigned lanes, std::uint32_t* codes) const {
    const Sixteen<Real> own = sixteenOf(boxes());
    std::uint32_t* next = codes;
    for (std::size_t i = 0; i < chosen_count; ++i) {
      const std::uint32_t place = chosen[i];
      const unsigned mask =
          own.overlapping(bounds, place) & lanes & Lanes::below(boxes().slot, greatest[place]);
      Lanes::writeNumbers(number[place] * group_size, mask, next);
      next += __builtin_popcount(mask);
    }
    return static_cast<std::size_t>(next - codes);
  }
  // Writes the part of a row that comes of a code; returns its length.
  template <bool filtered>
  int meet(std::uint32_t code, std::uint32_t* row) const {
    const unsigned lane = code % group_size;
    const std::size_t other = code / group_size;
    const Group<Real>& others = cells[other];
    const auto allowed = [&](unsigned hits) {
      if (!filtered || !hits) return hits;
      return hits & passesFilter(filters[cell], lane, filters[other]);
    };
    return meetLater(boxes(), lane, others, allowed, row);
  }
};

// Puts a row in order where it is to stay.
template <class Real>
inline void storeRow(RowSpace<Real>& space, std::uint32_t slot, const std::uint32_t* row,
                     std::size_t count) {
  if (count == 0) return;
  const std::size_t room = count + 1 + group_size;
  if (static_cast<std::size_t>(space.end - space.next) < room) space.growRows(room);
  std::uint32_t* const to = space.next;
  to[0] = static_cast<std::uint32_t>(count);
  if (count <= group_size)
    orderFew(row, count, to + 1);
  else
    orderMany(row, count, space.marks, space.marked_words, to + 1);
  space.rows[slot] = to;
  space.next += count + 1;
  space.counts[slot / row_chunk] += count;
}

// The rows of boxes [first, last) of the cell. A processor cannot predict how many cells a box
// meets, so what is to be met is listed for all boxes before any is, and it is wrong once.
template <bool filtered, class Real>
inline void findRowsOf(const CellAmongNear<Real> of, unsigned first, unsigned last,
                       RowSpace<Real>& space) {
  const std::size_t stride = (of.chosen_count + 1) * group_size;
  const std::size_t code_room = of.chosen_count * (last - first) + group_size;
  const std::size_t room = code_room + (last - first) * stride;
  if (space.word_room < room) space.growWords(room);
  std::uint32_t* const codes = space.words;
  std::uint32_t* row = codes + code_room;
  std::uint32_t* ends[group_size];
  for (unsigned lane = first; lane < last; ++lane) ends[lane] = row + (lane - first) * stride;
  const std::size_t count = of.list((1u << last) - (1u << first), codes);
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t*& end = ends[codes[i] % group_size];
    end += of.template meet<filtered>(codes[i], end);
  }
  for (unsigned lane = first; lane < last; ++lane, row += stride)
    storeRow(space, of.boxes().slot[lane], row, static_cast<std::size_t>(ends[lane] - row));
}

// The trees are walked once for all cells below a node; then each of them chooses among what was
// found, a box at a time if that is very much.
template <class Real>
void findRows(const RowSearch<Real>& search, RowSpace<Real>& space) {
  constexpr std::size_t most_at_once = 1024;  // fixed: chosen cells, with which rows take 1 MB
  const TreeView<Real>& own = search.trees[search.own];
  const Group<Real>* const all = own.levels[0] - own.first_cell;
  const GroupFilter* const filters = own.filters ? own.filters - own.first_cell : nullptr;
  for (std::size_t begin = search.begin, end; begin < search.end; begin = end) {
    const std::size_t node = begin / group_size, node_end = (node + 1) * group_size;
    end = node_end < search.end ? node_end : search.end;
    // The bounds of all cells below the node.
    Group<Real> bounds;
    const Group<Real>& cells = own.levels[1][node];
    for (int axis = 0; axis < 3; ++axis) {
      bounds.lower[axis][0] = Lanes::least(cells.lower[axis]);
      bounds.upper[axis][0] = Lanes::greatest(cells.upper[axis]);
    }
    NearCells<Real> near = {space};
    for (std::size_t i = 0; i < search.tree_count; ++i) {
      const TreeView<Real>& tree = search.trees[i];
      if (tree.depth == 0) continue;
      forOverlappingNodes(tree, bounds, 0, [&](std::uint32_t group, unsigned mask) {
        near.add(tree.levels[1][group], tree.first_cell + group * group_size, mask);
      });
    }
    near.close();
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t cell = own.first_cell + i;
      const Group<Real>& boxes = all[cell];
      const std::size_t chosen = near.choose(cells, i % group_size, boxes.slot[0]);
      const CellAmongNear<Real> of = {
          all, filters, cell, near.bounds(), space.greatest, space.cell, space.chosen, chosen};
      const unsigned used = static_cast<unsigned>(
          __builtin_popcount(Lanes::atLeast(boxes.lower[0], static_cast<Real>(-__builtin_inff()))));
      const unsigned step = chosen <= most_at_once ? group_size : 1;
      for (unsigned first = 0; first < used; first += step)
        (filters ? findRowsOf<true, Real>
                 : findRowsOf<false, Real>)(of, first, first + step < used ? first + step : used,
                                            space);
    }
  }
}

// Writes registers of pairs. What is beyond a row's end is overwritten by the next row; it may mark
// rows in vain.
bool writeRows(const Row* rows, std::size_t begin, std::size_t end, bool exact,
               std::uint64_t* pairs, std::uint64_t* pairs_end) {
  using Pairs = Register<std::uint64_t>::Type;
  constexpr std::size_t lanes = Register<std::uint64_t>::lanes;
  typedef std::uint32_t Words __attribute__((vector_size(sizeof(Pairs) / 2)));
  const std::uint32_t mark = exact ? 0 : 1;
  Words any{};
  for (std::size_t slot = begin; slot < end; ++slot) {
    if (slot + prefetch_distance < end) prefetch(rows[slot + prefetch_distance]);
    if (!rows[slot]) continue;
    const std::uint32_t count = rows[slot][0], *const row = rows[slot] + 1;
    const std::uint64_t earlier = std::uint64_t{slot} << 32;
    for (std::uint32_t i = 0; i < count; i += lanes) {
      Words words;
      memcpy(&words, row + i, sizeof words);
      any |= words;  // and of words beyond the row
      const Pairs wide = __builtin_convertvector(words, Pairs);
      const Pairs made = (wide >> 1) | earlier | (wide & mark) << 63;
      const std::size_t room = static_cast<std::size_t>(pairs_end - (pairs + i));
      memcpy(pairs + i, &made, room < lanes ? room * sizeof *pairs : sizeof made);
    }
    pairs += count;
  }
  bool marked = false;
  for (std::size_t lane = 0; lane < lanes; ++lane) marked |= any[lane] & mark;
  return marked;
}

}  // namespace
