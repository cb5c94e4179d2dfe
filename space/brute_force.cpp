#include "brute_force.h"

#include <algorithm>
#include <cstdint>

#include "floating_point.h"
#include "parallel.h"
#include "sink.h"

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

// Below this number of pairs a thread is not worth its start.
constexpr std::uint64_t least_pairs_a_thread = 1 << 18;

// Tests a box after which a crowd must have shown to be one: about a quarter of what the sweep of
// moved boxes takes (10,000 boxes, one thread: 0.3 ns a test, 260 ns a box).
constexpr std::uint64_t first_tests_a_box = 200;
// Between two looks at whether it is one, the number of tests grows by this factor.
constexpr std::uint64_t growth = 4;

int partsFor(std::uint64_t tests, int threads) {
  return static_cast<int>(std::min<std::uint64_t>(threads, tests / least_pairs_a_thread + 1));
}

// Notes where unsure pairs may be.
void noteUnsure(PairList& pairs) {
  for (std::size_t part = 0; part < pairs.parts.size(); ++part) {
    Pair all_bits = 0;
    for (const Pair pair : pairs.parts[part]) all_bits |= pair;
    if (isUnsure(all_bits)) pairs.unsure.push_back({part, 0, pairs.parts[part].size()});
  }
}

}  // namespace

template <class Real>
void BruteForce<Real>::packCells(const BoxSet& boxes, int threads) {
  const std::size_t cell_count = (boxes.size + group_size - 1) / group_size;
  starts_.resizeDiscarding(cell_count + 1);
  for (std::size_t i = 0; i < cell_count; ++i)
    starts_[i] = static_cast<std::uint32_t>(i * group_size);
  starts_[cell_count] = static_cast<std::uint32_t>(boxes.size);
  cells_.build(boxes, nullptr, starts_.data(), cell_count, threads,
               CellTree<Real>::Levels::cells_only);
}

// Makes the tests of this range, by their numbers, and leaves their pairs in `threads` parts from
// the first on, with room for `expected` pairs. Returns the number of threads used.
template <class Real>
int BruteForce<Real>::testPart(const BoxSet& boxes, Range tests, int threads,
                               std::size_t first_part, std::size_t expected,
                               PairList& pairs) const {
  const Triangle triangle = {boxes.size};
  const TreeView<Real>& cells = cells_.view();
  const Kernels<Real>& kernel = kernels<Real>();
  int used = 1;
  runTeam(partsFor(tests.end - tests.begin, threads), [&](int thread, int team) {
    if (thread == 0) used = team;
    Buffer<Pair>& part = pairs.parts[first_part + thread];
    part.reserve(expected / team);
    BufferSink sink(part);
    const Range own = partOf(tests.end - tests.begin, thread, team);
    const Range range = {tests.begin + own.begin, tests.begin + own.end};
    if (range.begin == range.end) return;
    const std::uint64_t first = triangle.rowOf(range.begin), last = triangle.rowOf(range.end - 1);
    const TrianglePart rows = {boxes.size, first,
                               first + 1 + (range.begin - triangle.rowBegin(first)), last,
                               last + 1 + (range.end - triangle.rowBegin(last))};
    kernel.trianglePairs(cells, rows, boxes.exact, sink);
  });
  return used;
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
  packCells(boxes, partsFor(tests, threads));
  const int used = testPart(boxes, {0, tests}, threads, 0, 0, pairs);
  if (!boxes.exact) noteUnsure(pairs);
  return used;
}

// Begins with the rows of the middle: the geoms that programs make first are often unlike the
// others. The first quarter of the tests comes last, and its parts first.
template <class Real>
int BruteForce<Real>::findCrowd(const BoxSet& boxes, int threads, std::uint64_t places_of_a_pair,
                                PairList& pairs) {
  if (boxes.size < 2) return find(boxes, threads, pairs);
  const ScopedMode mode(exactMode());
  const std::uint64_t all = Triangle{boxes.size}.pairs(), middle = all / 4;
  std::size_t rounds = 1;
  for (std::uint64_t tests = first_tests_a_box * boxes.size; middle + tests < all; tests *= growth)
    ++rounds;
  pairs.clear((rounds + 1) * threads);
  packCells(boxes, partsFor(all, threads));
  int used = 1;
  std::uint64_t tested = 0, next = first_tests_a_box * boxes.size;
  // Pairs to make room for, an eighth more than so far, since storage that grows is copied.
  const auto expected = [&](std::uint64_t tests) {
    return tested
               ? static_cast<std::size_t>(1.125 * static_cast<double>(pairs.size()) *
                                          static_cast<double>(tests) / static_cast<double>(tested))
               : 0;
  };
  for (std::size_t round = 1; round <= rounds; ++round, next *= growth) {
    const Range tests = {middle + tested, std::min(all, middle + next)};
    used = std::max(used, testPart(boxes, tests, threads, round * threads,
                                   expected(tests.end - tests.begin), pairs));
    tested = tests.end - middle;
    if (round < rounds && pairs.size() * places_of_a_pair < tested) return 0;
  }
  used = std::max(used, testPart(boxes, {0, middle}, threads, 0, expected(middle), pairs));
  if (!boxes.exact) noteUnsure(pairs);
  return used;
}

template class BruteForce<float>;
template class BruteForce<double>;

}  // namespace ode_parallel_sap
