// The kernels for the `Lanes` that the including file has. Everything here has internal linkage:
// each including file is compiled for an instruction set of its own, and no function of it may be
// shared with, or replaced by, another file's.
#pragma once

#include <string.h>

#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/simd/kernel_halves.h"
#include "space/simd/kernel_kept_pairs.h"
#include "space/simd/kernel_overlaps.h"
#include "space/simd/kernel_rows.h"

namespace {

// A processor cannot predict which cells have hits, so many of them are met before any are written,
// and it is wrong once for all of them.
template <class Real>
std::size_t testLater(const Group<Real>* cells, std::size_t all, std::size_t place,
                      std::uint32_t* found) {
  constexpr std::size_t most_cells = 32;  // fixed: bits of `hit`
  const std::size_t own = place / group_size;
  const unsigned lane = place % group_size;
  std::uint32_t* next = found;
  for (std::size_t first = own, count; first < all; first += count) {
    count = all - first < most_cells ? all - first : most_cells;
    unsigned masks[most_cells];
    std::uint32_t hit = 0;  // cells, by bits
    for (std::size_t i = 0; i < count; ++i) {
      masks[i] = overlaps(cells[own], lane, cells[first + i]);
      hit |= std::uint32_t{masks[i] != 0} << i;
    }
    if (first == own && (masks[0] &= ~0u << lane << 1) == 0) hit &= ~1u;
    for (; hit; hit &= hit - 1) {
      const unsigned i = static_cast<unsigned>(__builtin_ctz(hit));
      Lanes::writeNumbers(static_cast<std::uint32_t>((first + i) * group_size), masks[i], next);
      next += __builtin_popcount(masks[i]);
    }
  }
  return static_cast<std::size_t>(next - found);
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
  pick<0, 4, 1, 5>(front[0], front[1], &half[0]);
  pick<0, 4, 1, 5>(front[2], front[3], &half[1]);
  pick<0, 1, 4, 5>(half[0], half[1], cell.lower[0] + lane);
  pick<2, 3, 6, 7>(half[0], half[1], cell.lower[1] + lane);
  pick<0, 4, 1, 5>(back[0], back[1], &half[0]);
  pick<0, 4, 1, 5>(back[2], back[3], &half[1]);
  pick<0, 1, 4, 5>(half[0], half[1], cell.lower[2] + lane);
  pick<2, 3, 6, 7>(half[0], half[1], cell.upper[0] + lane);
  pick<2, 6, 3, 7>(back[0], back[1], &half[0]);
  pick<2, 6, 3, 7>(back[2], back[3], &half[1]);
  pick<0, 1, 4, 5>(half[0], half[1], cell.upper[1] + lane);
  pick<2, 3, 6, 7>(half[0], half[1], cell.upper[2] + lane);
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
    if (cell + packed_ahead < end)
      for (std::uint32_t i = starts[cell + packed_ahead]; i < starts[cell + packed_ahead + 1]; ++i)
        prefetch(boxes + order[i]);
    const BasicBox<Real>* from[group_size];
    for (std::uint32_t lane = 0; lane < group_size; ++lane) {
      const bool used = lane < count;
      const std::uint32_t slot = order[used ? start + lane : start];
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
    }
}

template <class Real>
constexpr Kernels<Real> kernelsFor() {
  return {packCells<Real>,  packBounds<Real>,  findPairs<Real>, testLater<Real>,
          findInTree<Real>, findInCells<Real>, meetRay<Real>};
}

constexpr KernelSet kernel_set = {Lanes::name,  kernelsFor<float>(), kernelsFor<double>(),
                                  boxesOutside, keptPairs,           cutIntoCells,
                                  writeRows};

}  // namespace
