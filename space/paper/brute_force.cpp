#include "space/paper/brute_force.h"

#include <cstdint>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

// Rows of the triangle of pairs (row, column > row), numbered one row after the other.
struct Triangle {
  std::uint64_t boxes;

  std::uint64_t pairs() const { return boxes * (boxes - 1) / 2; }
  std::uint64_t rowBegin(std::uint64_t row) const { return row * boxes - row * (row + 1) / 2; }
  // The row of a pair's number; beyond the last one the last row, which has no pair.
  Slot rowOf(std::uint64_t pair) const {
    std::uint64_t low = 0, high = boxes;  // rowBegin(low) <= pair
    while (high - low > 1) {
      const std::uint64_t middle = low + (high - low) / 2;
      (rowBegin(middle) <= pair ? low : high) = middle;
    }
    return static_cast<Slot>(low);
  }
};

Region testing("brute force: pairs");

}  // namespace

// Places are slots.
template <class Real>
void BruteForce<Real>::packCells(const BoxSet& boxes) {
  cells_.resizeDiscarding(groupsFor(boxes.size));
  for (std::size_t place = 0; place < cells_.size() * group_size; ++place)
    put(place < boxes.size ? boxesOf<Real>(boxes)[place] : inactiveBox<Real>(),
        cells_[place / group_size], place % group_size);
}

// Each thread tests an equal part of the table, up to a row. Returns the number of threads used.
template <class Real>
int BruteForce<Real>::testAll(const BoxSet& boxes, std::uint64_t tests, int threads,
                              PairList& pairs) {
  const Triangle triangle = {boxes.size};
  const Kernels<Real>& kernel = kernels<Real>();
  const BasicBox<Real>* const all = boxesOf<Real>(boxes);
  const bool filtered = boxes.filter_bits || boxes.filter_bodies, inexact = !boxes.exact;
  return runTeam(testing, teamFor(tests, grains::box_tests, threads), [&](int thread, int team) {
    const Range own = ownPart(tests, thread, team);
    Buffer<Pair>& written = pairs.parts[thread];
    Buffer<std::uint32_t>& row = rows_[thread];
    row.resizeDiscarding(boxes.size + group_size);
    const Slot end = triangle.rowOf(own.end);
    for (Slot slot = triangle.rowOf(own.begin); slot < end; ++slot) {
      const std::size_t before = written.size();
      const std::size_t count = kernel.testLater(cells_.data(), cells_.size(), slot, row.data());
      written.resize(before + count);
      Pair* next = written.data() + before;
      const BasicBox<Real> box = all[slot];
      for (std::size_t i = 0; i < count; ++i) {
        if (filtered && !passesFilters(boxes, slot, row[i])) continue;
        const bool borderline = inexact & isBorderline(box, all[row[i]]);
        *next++ = makePair(slot, row[i]) | Pair{borderline} << 63;
      }
      written.resize(next - written.data());
    }
  });
}

template <class Real>
int BruteForce<Real>::find(const BoxSet& boxes, int threads, PairList& pairs,
                           const PairTest* test) {
  const ScopedMode mode(exactMode());
  const std::uint64_t tests = Triangle{boxes.size}.pairs();
  pairs.clear(threads);
  if (rows_.size() < static_cast<std::size_t>(threads)) rows_.resize(threads);
  packCells(boxes);
  const int used = testAll(boxes, tests, threads, pairs);
  pairs.addParts(boxes.exact);
  pairs.decide(test, threads);
  return used;
}

template class BruteForce<float>;
template class BruteForce<double>;

}  // namespace ode_parallel_sap
