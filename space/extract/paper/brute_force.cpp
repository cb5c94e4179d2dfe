#include "space/extract/paper/brute_force.h"

#include <algorithm>
#include <cstdint>

#include "space/data/floating_point.h"
#include "space/data/mechanisms.h"
#include "space/data/parallel.h"
#include "space/data/tuning.h"
#include "space/extract/paper/tuning.h"
#include "space/simd/sink.h"

namespace ode_parallel_sap {

namespace {

// Rows of the triangle of pairs (row, column > row), numbered one row after the other.
struct Triangle {
  std::uint64_t boxes;

  std::uint64_t pairs() const { return boxes * (boxes - 1) / 2; }
  std::uint64_t rowBegin(std::uint64_t row) const { return row * boxes - row * (row + 1) / 2; }
  // The row of a pair's number.
  std::uint64_t rowOf(std::uint64_t pair) const {
    std::uint64_t low = 0, high = boxes - 1;  // rowBegin(low) <= pair < rowBegin(high)
    while (high - low > 1) {
      const std::uint64_t middle = low + (high - low) / 2;
      (rowBegin(middle) <= pair ? low : high) = middle;
    }
    return low;
  }
};

Region testing("brute force: pairs");

// fixed: between two looks at whether it is one, the number of tests grows by this factor. They
// cost little beside the tests.
constexpr std::uint64_t growth = 4;

}  // namespace

template <class Real>
void BruteForce<Real>::packCells(const BoxSet& boxes, int threads) {
  const std::size_t cell_count = (boxes.size + group_size - 1) / group_size;
  starts_.resizeDiscarding(cell_count + 1);
  for (std::size_t i = 0; i < cell_count; ++i)
    starts_[i] = static_cast<std::uint32_t>(i * group_size);
  starts_[cell_count] = static_cast<std::uint32_t>(boxes.size);
  const CellClass all = {0, cell_count};
  cells_.build(boxes, {nullptr, starts_.data()}, {&all, 1}, threads,
               CellTrees<Real>::Levels::cells_only);
}

// Makes the tests [tests.begin, tests.end) of each stripe of the table, and leaves their pairs in
// part (stripe * rounds + round) * threads + thread, with room for `expected` pairs in all. Returns
// the number of threads used.
template <class Real>
int BruteForce<Real>::testRound(const BoxSet& boxes, const Round& round, int threads,
                                PairList& pairs) {
  const Triangle triangle = {boxes.size};
  const TreeView<Real>& cells = cells_.views()[0];
  const Kernels<Real>& kernel = kernels<Real>();
  const std::uint64_t count = (round.tests.end - round.tests.begin) * round.stripes;
  return runTeam(testing, teamFor(count, grains::box_tests, threads), [&](int thread, int team) {
    for (int stripe = 0; stripe < round.stripes; ++stripe) {
      const std::size_t part = (stripe * round.rounds + round.number) * threads + thread;
      Buffer<Pair>& written = pairs.parts[part];
      written.reserve(round.expected / (team * round.stripes));
      const Range all = partOf(triangle.pairs(), stripe, round.stripes);
      const std::uint64_t begin = std::min(all.begin + round.tests.begin, all.end);
      const Range own =
          ownPart(std::min(all.begin + round.tests.end, all.end) - begin, thread, team);
      if (own.begin == own.end) continue;
      const std::uint64_t from = begin + own.begin, to = begin + own.end;
      const std::uint64_t first = triangle.rowOf(from), last = triangle.rowOf(to - 1);
      const TrianglePart rows = {boxes.size, first, first + 1 + (from - triangle.rowBegin(first)),
                                 last, last + 1 + (to - triangle.rowBegin(last))};
      {
        BufferSink sink(written);
        kernel.trianglePairs(cells, rows, boxes.exact, sink);
      }
      if (!boxes.exact)
        noteBorderline(written.data(), {part, 0, written.size()}, borderline_[thread]);
    }
  });
}

template <class Real>
void BruteForce<Real>::clearBorderline(int threads) {
  if (borderline_.size() < static_cast<std::size_t>(threads)) borderline_.resize(threads);
  for (auto& segments : borderline_) segments.clear();
}

template <class Real>
void BruteForce<Real>::joinBorderline(PairList& pairs) const {
  for (const auto& segments : borderline_)
    pairs.borderline.insert(pairs.borderline.end(), segments.begin(), segments.end());
}

template <class Real>
int BruteForce<Real>::find(const BoxSet& boxes, int threads, PairList& pairs) {
  if (boxes.size < 2) {
    pairs.clear(1);
    return 1;
  }
  const ScopedMode mode(exactMode());
  const std::uint64_t tests = Triangle{boxes.size}.pairs();
  pairs.clear(threads);
  clearBorderline(threads);
  packCells(boxes, teamFor(tests, grains::box_tests, threads));
  const int used = testRound(boxes, {1, 1, 0, {0, tests}, 0}, threads, pairs);
  joinBorderline(pairs);
  return used;
}

// Each round tests a part of each stripe, since the geoms that a program makes first are often
// unlike the others.
template <class Real>
int BruteForce<Real>::findDense(const BoxSet& boxes, int threads, PairList& pairs) {
  constexpr int stripes = 4;  // fixed: a few places of the table that are looked at first
  const std::uint64_t all = Triangle{boxes.size}.pairs(), stripe = all / stripes + 1;
  std::uint64_t next = first_tests_a_box * boxes.size / stripes;
  // No dense scene is told apart by half of all tests.
  if (boxes.size < 2 || 2 * next >= stripe || !mechanisms::dense_scenes_given_up)
    return find(boxes, threads, pairs);
  const ScopedMode mode(exactMode());
  int rounds = 1;
  for (std::uint64_t tests = next; 2 * tests < stripe; tests *= growth) ++rounds;
  pairs.clear(static_cast<std::size_t>(stripes * rounds * threads));
  clearBorderline(threads);
  packCells(boxes, teamFor(all, grains::box_tests, threads));
  int used = 1;
  std::uint64_t tested = 0;
  double pairs_a_test = 0;
  for (int number = 0; number < rounds; ++number, next *= growth) {
    const bool last = number + 1 == rounds;
    const Range tests = {tested, last ? stripe : next};
    // An eighth more than so far, since storage that grows is copied.
    const double expected =
        1.125 * pairs_a_test * static_cast<double>(stripes * (tests.end - tests.begin));
    const Round round = {stripes, rounds, number, tests, static_cast<std::size_t>(expected)};
    used = std::max(used, testRound(boxes, round, threads, pairs));
    tested = tests.end;
    if (last) break;
    // A test is for two places of the table.
    if (pairs.size() * places_of_a_pair < 2 * stripes * tested) return 0;
    pairs_a_test = static_cast<double>(pairs.size()) / static_cast<double>(stripes * tested);
  }
  joinBorderline(pairs);
  return used;
}

template class BruteForce<float>;
template class BruteForce<double>;

}  // namespace ode_parallel_sap
