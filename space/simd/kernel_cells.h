// Cells of boxes and trees, packed, and met by a box or a ray. Internal linkage (kernels_impl.h).
#pragma once

#include <string.h>

#include "space/base/box_set.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/simd/kernels.h"

namespace {

using namespace ode_parallel_sap;

constexpr unsigned all_lanes = 0xffff;

template <class Real>
using Sixteen = Lanes::Sixteen<Real>;

// For overlapping(): NaN overlaps nothing, and inverted boxes do as the exact formula says; so do
// bounds made of least and greatest ones.
template <class Real>
inline Sixteen<Real> sixteenOf(const Group<Real>& boxes) {
  return {boxes.lower[0], boxes.upper[0], group_size};
}

// Which of sixteen boxes may meet box `lane` by their bits and bodies.
inline unsigned passesFilter(const GroupFilter& filter, unsigned lane, const GroupFilter& others) {
  const unsigned wanted = Lanes::sharesBits(others.collide, filter.category[lane]) |
                          Lanes::sharesBits(others.category, filter.collide[lane]);
  return filter.body[lane] ? wanted & ~Lanes::equals(others.body, filter.body[lane]) : wanted;
}

// Which of sixteen boxes overlap box `lane` of `box`; from bit 16 on which of them may, as only the
// exact boxes can tell: a bound is equal to the opposite one. Doubles are the exact bounds.
template <class Real>
inline std::uint32_t meetings(const Group<Real>& box, unsigned lane, const Group<Real>& boxes) {
  if constexpr (sizeof(Real) == sizeof(float))
    return Lanes::meetings(
        boxes, [&](int axis, int) { return box.lower[axis][lane]; },
        [&](int axis, int) { return box.upper[axis][lane]; });
  else
    return sixteenOf(boxes).overlapping(box, lane);
}

// Calls use(i, bit) for all bits of masks[0] to masks[count - 1], none of which is zero. There is
// no branch that depends on them, as a processor could not predict it. One more may be read.
template <class Use>
inline void forBits(const std::uint32_t* masks, std::size_t count, Use use) {
  std::uint32_t mask = masks[0];
  for (std::size_t i = 0; i < count;) {
    const std::size_t at = i;
    const std::uint32_t following = masks[i + 1], rest = mask & (mask - 1);
    const unsigned bit = static_cast<unsigned>(__builtin_ctz(mask));
    i += rest == 0;
    mask = rest ? rest : following;
    use(at, bit);
  }
}

// Both bounds on each axis are moved apart by the margin, so that errors of rounding, which are
// far smaller, leave no box out.
template <class Real>
unsigned meetRay(const Group<Real>& boxes, const RayQuery<Real>& ray, Real limit, Real* entry) {
  using Lane = Register<Real>;
  using Vector = typename Lane::Type;
  for (int first = 0; first < group_size; first += Lane::lanes) {
    Vector lower[3], upper[3], reach{};
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = Lanes::load(boxes.lower[axis] + first) - ray.origin[axis];
      upper[axis] = Lanes::load(boxes.upper[axis] + first) - ray.origin[axis];
      reach = Lane::greatest(Lane::greatest(-lower[axis], upper[axis]), reach);
    }
    const Vector margin = reach * ray.rounding + ray.slack;
    Vector near{}, far = near + limit;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector a = (lower[axis] - margin) * ray.inverse[axis];
      const Vector b = (upper[axis] + margin) * ray.inverse[axis];
      near = Lane::greatest(Lane::least(a, b), near);
      far = Lane::least(Lane::greatest(b, a), far);
    }
    // An unused place is NaN on all axes.
    const Vector none = Vector{} + static_cast<Real>(__builtin_nanf(""));
    *reinterpret_cast<Vector*>(entry + first) =
        ((near <= far) & (lower[0] == lower[0])) ? near : none;
  }
  return Lanes::atLeast(entry, Real(0));
}

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
    unsigned mask = sixteenOf(tree.levels[node.level][node.group]).overlapping(box, lane);
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

// Meets many cells at a time, so that a processor need not know what is in one to read the next.
template <class Real>
std::size_t findInTree(const TreeView<Real>& tree, const Group<Real>& box, std::uint32_t* found) {
  constexpr std::size_t gathered_nodes = 256;  // a round number: they stay in the nearest cache
  std::uint32_t cells[gathered_nodes + group_size];
  std::size_t count = 0;
  std::uint32_t* next = found;
  std::uint32_t masks[gathered_nodes + group_size + 1];
  const auto meet = [&] {
    std::size_t met = 0;
    for (std::size_t i = 0; i < count; ++i) {
      masks[met] = meetings(box, 0, tree.levels[0][cells[i]]);
      cells[met] = cells[i];
      met += masks[met] != 0;
    }
    forBits(masks, met, [&](std::size_t i, unsigned bit) {
      *next++ = 2 * tree.levels[0][cells[i]].slot[bit % group_size] + bit / group_size;
    });
    count = 0;
  };
  forOverlappingNodes(tree, box, 0, 0, [&](std::uint32_t node, unsigned mask) {
    count += Lanes::writeNumbers(node * group_size, mask, cells + count);
    if (count >= gathered_nodes) meet();
  });
  meet();
  return next - found;
}

template <class Real>
std::size_t findInCells(const Group<Real>* cells, std::size_t count, const Group<Real>& box,
                        std::uint32_t* found) {
  std::uint32_t* next = found;
  for (std::size_t cell = 0; cell < count; ++cell) {
    const std::uint32_t masks[2] = {meetings(box, 0, cells[cell])};
    forBits(masks, masks[0] != 0, [&](std::size_t, unsigned bit) {
      *next++ = 2 * cells[cell].slot[bit % group_size] + bit / group_size;
    });
  }
  return next - found;
}

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
      masks[i] = sixteenOf(cells[first + i]).overlapping(cells[own], lane);
      hit |= std::uint32_t{masks[i] != 0} << i;
    }
    if (first == own && (masks[0] &= ~0u << lane << 1) == 0) hit &= ~1u;
    for (; hit; hit &= hit - 1) {
      const unsigned i = static_cast<unsigned>(__builtin_ctz(hit));
      const auto number = static_cast<std::uint32_t>((first + i) * group_size);
      next += Lanes::writeNumbers(number, masks[i], next);
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
            child < count ? Lanes::outermost<false>(children[child].lower[axis]) : nan;
        parents[parent].upper[axis][lane] =
            child < count ? Lanes::outermost<true>(children[child].upper[axis]) : nan;
      }
    }
}

}  // namespace
