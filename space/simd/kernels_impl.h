// The kernels for the `Lanes` that the including file chose. Everything here has internal linkage:
// each including file is compiled for an instruction set of its own, and no function of it may be
// shared with, or replaced by, another file's.
#pragma once

#include <string.h>

#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/simd/kernel_box_pairs.h"
#include "space/simd/kernel_halves.h"
#include "space/simd/kernel_kept_pairs.h"
#include "space/simd/kernel_overlaps.h"
#include "space/simd/kernel_rays.h"
#include "space/simd/kernel_rows.h"
#include "space/simd/kernel_trees.h"

namespace {

// Pairs of box `lane` of the query with the boxes at places [begin, end). A processor cannot
// predict which cells have hits, so many of them are met before any are written, and it is wrong
// once for all of them.
template <class Real>
inline void boxAgainstCells(const Query<Real>& query, unsigned lane, const TreeView<Real>& cells,
                            std::size_t begin, std::size_t end, PairSink& sink) {
  constexpr std::size_t most_cells = 32;  // fixed: bits of `hit`
  unsigned masks[most_cells];
  const std::size_t last = (end + group_size - 1) / group_size;
  for (std::size_t first = begin / group_size, count; first < last; first += count) {
    count = last - first < most_cells ? last - first : most_cells;
    const Group<Real>* const boxes = cells.levels[0] + first;
    unsigned mask = overlaps(*query.boxes, lane, boxes[0]);
    if (first * group_size < begin) mask = mask >> begin % group_size << begin % group_size;
    masks[0] = mask;
    std::uint32_t hit = mask != 0;  // cells, by bits
    for (std::size_t i = 1; i < count; ++i) {
      masks[i] = mask = overlaps(*query.boxes, lane, boxes[i]);
      hit |= std::uint32_t{mask != 0} << i;
    }
    if (end < (first + count) * group_size) masks[count - 1] &= (1u << end % group_size) - 1;
    for (; hit; hit &= hit - 1) {
      const unsigned i = static_cast<unsigned>(__builtin_ctz(hit));
      writeHits(query, lane, masks[i], cells, first + i, sink);
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
      if (end <= begin) continue;
      makeRoom(sink, end - begin + group_size);
      boxAgainstCells(query, row % group_size, cells, begin, end, sink);
    }
  }
}

// Four boxes become four numbers of each bound, from `lane` on.
template <class Real>
inline void packFour(const BasicBox<Real>* const* boxes, Group<Real>& cell, std::uint32_t lane) {
  using Type = typename FourOf<Real>::Type;
  Type front[4], back[4];  // first and last four of a box's six numbers
  for (int i = 0; i < 4; ++i) {
    memcpy(&front[i], boxes[i]->lower, sizeof(Type));
    memcpy(&back[i], boxes[i]->lower + 2, sizeof(Type));
  }
  Type half[2];
  pick<Real, 0, 4, 1, 5>(front[0], front[1], &half[0]);
  pick<Real, 0, 4, 1, 5>(front[2], front[3], &half[1]);
  pick<Real, 0, 1, 4, 5>(half[0], half[1], cell.lower[0] + lane);
  pick<Real, 2, 3, 6, 7>(half[0], half[1], cell.lower[1] + lane);
  pick<Real, 0, 4, 1, 5>(back[0], back[1], &half[0]);
  pick<Real, 0, 4, 1, 5>(back[2], back[3], &half[1]);
  pick<Real, 0, 1, 4, 5>(half[0], half[1], cell.lower[2] + lane);
  pick<Real, 2, 3, 6, 7>(half[0], half[1], cell.upper[0] + lane);
  pick<Real, 2, 6, 3, 7>(back[0], back[1], &half[0]);
  pick<Real, 2, 6, 3, 7>(back[2], back[3], &half[1]);
  pick<Real, 0, 1, 4, 5>(half[0], half[1], cell.upper[1] + lane);
  pick<Real, 2, 3, 6, 7>(half[0], half[1], cell.upper[2] + lane);
}

template <class Real>
void packCells(const BasicBox<Real>* boxes, const CellBoxes& of, std::size_t begin, std::size_t end,
               Group<Real>* cells) {
  static_assert(sizeof(BasicBox<Real>) == 6 * sizeof(Real), "six numbers in a row");
  const std::uint32_t *const order = of.order, *const starts = of.starts;
  const Real nan = static_cast<Real>(__builtin_nanf(""));
  const BasicBox<Real> none = {{nan, nan, nan}, {nan, nan, nan}};
  for (std::size_t cell = begin; cell < end; ++cell) {
    const std::uint32_t start = starts[cell], count = starts[cell + 1] - start;
    if (order && cell + packed_ahead < end)
      for (std::uint32_t i = starts[cell + packed_ahead]; i < starts[cell + packed_ahead + 1]; ++i)
        prefetch(boxes + order[i]);
    const BasicBox<Real>* from[group_size];
    for (std::uint32_t lane = 0; lane < group_size; ++lane) {
      const bool used = lane < count;
      const std::uint32_t at = used ? start + lane : start;
      const std::uint32_t slot = order ? order[at] : at;
      cells[cell].slot[lane] = slot;
      from[lane] = used ? boxes + slot : &none;
    }
    for (std::uint32_t lane = 0; lane < group_size; lane += 4)
      packFour(from + lane, cells[cell], lane);
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
      parents[parent].slot[lane] = child < count ? greatestSlot(children[child]) : 0;
    }
}

template <class Real>
constexpr Kernels<Real> kernelsFor() {
  return {packCells<Real>,  packBounds<Real>,  findRows<Real>,   trianglePairs<Real>,
          findInTree<Real>, findInCells<Real>, boxesApart<Real>, meetRay<Real>};
}

constexpr KernelSet kernel_set = {Lanes::name,  kernelsFor<float>(), kernelsFor<double>(),
                                  boxesOutside, keptPairs,           cutIntoCells,
                                  writeRows};

}  // namespace
