#include "space/paper/axis_lists.h"

#include <algorithm>
#include <cstring>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

// In place of the later box of an entry that does not overlap after all.
constexpr Slot no_slot = ~Slot{0};

Region sorting("axis lists: axes"), filling("axis lists: places"),
    meeting("axis lists: pairs of all axes");

// Closed intervals: a row reaches lower bounds that are equal to the box's upper one.
template <class Real>
void findRows(const BasicBox<Real>* boxes, std::size_t slots, int axis, AxisRows& rows) {
  rows.order.resizeDiscarding(0);
  for (std::size_t slot = 0; slot < slots; ++slot)
    if (isActive(boxes[slot])) rows.order.push_back(static_cast<std::uint32_t>(slot));
  std::uint32_t *const begin = rows.order.begin(), *const end = rows.order.end();
  std::stable_sort(begin, end, [=](std::uint32_t a, std::uint32_t b) {
    return boxes[a].lower[axis] < boxes[b].lower[axis];
  });
  rows.ranks.resizeDiscarding(slots);
  rows.reach.resizeDiscarding(rows.order.size());
  for (std::uint32_t rank = 0; rank < rows.order.size(); ++rank) {
    const std::uint32_t slot = rows.order[rank];
    const auto isBelow = [=](Real upper, std::uint32_t b) { return upper < boxes[b].lower[axis]; };
    rows.ranks[slot] = rank;
    rows.reach[rank] = static_cast<std::uint32_t>(
        std::upper_bound(begin, end, boxes[slot].upper[axis], isBelow) - begin);
  }
  rows.layOut();
}

// Lists get some room to grow.
std::uint64_t roomFor(std::uint64_t pairs) {
  return pairs + pairs / 8;
}

// Calls work(row, place, end) for each row of which some places are in [begin, end).
template <class Work>
void forRows(const AxisRows& rows, std::uint64_t begin, std::uint64_t end, Work work) {
  if (begin == end) return;
  for (std::uint32_t row = rows.rowOf(begin); begin < end; ++row) {
    const std::uint64_t row_end = std::min(end, rows.begins[row + 1]);
    if (begin < row_end) work(row, begin, row_end);
    begin = std::max(begin, row_end);
  }
}

// Writes the later boxes of the pairs [begin, end) of an axis.
void fillPlaces(const AxisRows& rows, std::uint64_t begin, std::uint64_t end, Slot* list) {
  forRows(rows, begin, end, [&](std::uint32_t row, std::uint64_t place, std::uint64_t row_end) {
    const std::uint64_t first = row + 1 + (place - rows.begins[row]);
    std::memcpy(list + place, rows.order.data() + first, (row_end - place) * sizeof(Slot));
    if (!rows.inverted) return;
    for (std::uint64_t i = 0; i < row_end - place; ++i)
      if (!rows.overlapsRow(static_cast<std::uint32_t>(first + i), row)) list[place + i] = no_slot;
  });
}

// Whether the list of an axis holds the pair of two boxes.
bool holds(const AxisRows& rows, const Slot* list, Slot a, Slot b) {
  const std::uint32_t rank_a = rows.ranks[a], rank_b = rows.ranks[b];
  const std::uint32_t row = std::min(rank_a, rank_b), other = std::max(rank_a, rank_b);
  return other < rows.reach[row] &&
         list[rows.begins[row] + (other - row - 1)] == (rank_a < rank_b ? b : a);
}

}  // namespace

std::uint32_t AxisRows::rowOf(std::uint64_t place) const {
  return static_cast<std::uint32_t>(
      std::upper_bound(begins.data(), begins.data() + order.size(), place) - begins.data() - 1);
}

void AxisRows::layOut() {
  const std::size_t count = order.size();
  begins.resizeDiscarding(count + 1);
  inverted = false;
  std::uint64_t place = 0;
  for (std::size_t row = 0; row < count; ++row) {
    begins[row] = place;
    if (reach[row] > row + 1) place += reach[row] - row - 1;
    inverted |= reach[row] <= row;
  }
  begins[count] = place;
}

void sortAxes(const BoxSet& boxes, int threads, AxisRows (&rows)[3]) {
  const int most = teamFor(boxes.size, grains::items, threads);
  runTeam(sorting, most, [&](int thread, int team) {
    for (int axis = thread; axis < 3; axis += team) {
      noteWork();
      if (boxes.wide)
        findRows(boxes.wide_boxes.data(), boxes.size, axis, rows[axis]);
      else
        findRows(boxes.boxes.data(), boxes.size, axis, rows[axis]);
    }
  });
}

void AxisLists::reserveLists() {
  std::uint64_t needed = 0, held = 0;
  for (int axis = 0; axis < 3; ++axis) {
    needed += roomFor(rows_[axis].pairs()) * sizeof(Slot);
    held += lists_[axis].bytes();
  }
  const std::uint64_t most = most_list_bytes.load(std::memory_order_relaxed);
  const std::uint64_t allowed = most ? most : needed <= held ? held : (freeMemory() + held) / 2;
  if (needed > allowed) throw ListsTooLong(needed, allowed);
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint64_t pairs = rows_[axis].pairs();
    if (lists_[axis].capacity() < pairs) {
      lists_[axis].release();
      lists_[axis].reserve(roomFor(pairs));
    }
  }
}

// The pairs [begin, end) of the fullest axis that the others hold, too.
void AxisLists::meet(const BoxSet& boxes, const AxisChoice& axes, std::uint64_t begin,
                     std::uint64_t end, int thread) {
  const AxisRows &first = rows_[axes.fullest], &second = rows_[axes.second],
                 &third = rows_[axes.third];
  forRows(first, begin, end, [&](std::uint32_t row, std::uint64_t place, std::uint64_t row_end) {
    const Slot a = first.order[row];
    for (; place < row_end; ++place) {
      const Slot b = lists_[axes.fullest][place];
      if (b == no_slot || !holds(second, lists_[axes.second].data(), a, b) ||
          !holds(third, lists_[axes.third].data(), a, b))
        continue;
      Pair pair;
      if (writePair(boxes, a, b, &pair) != &pair) found_.add(thread, pair);
    }
  });
}

int AxisLists::find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) {
  if (boxes.size < 2) {
    pairs.clear(1);
    return 1;
  }
  const ScopedMode mode(exactMode());
  sortAxes(boxes, threads, rows_);
  reserveLists();
  const AxisChoice axes = chooseAxes(rows_);
  const std::uint64_t count = rows_[axes.fullest].pairs();
  threads = teamFor(count, grains::moved_pairs, threads);
  for (int axis = 0; axis < 3; ++axis) {
    const AxisRows& rows = rows_[axis];
    runChunks(filling, threads, rows.pairs(), chunkOf(rows.pairs(), chunk_pairs, threads),
              [&](const Range& range, int) {
                fillPlaces(rows, range.begin, range.end, lists_[axis].data());
              });
  }

  found_.start(boxes.size, threads);
  const std::size_t chunk = chunkOf(count, chunk_pairs, threads);
  const int used = runChunks(meeting, threads, count, chunk, [&](const Range& range, int thread) {
    meet(boxes, axes, range.begin, range.end, thread);
  });
  found_.writePairs(boxes.exact, threads, test, pairs);
  return used;
}

}  // namespace ode_parallel_sap
