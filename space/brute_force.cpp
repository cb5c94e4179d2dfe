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

}  // namespace

int BruteForce::find(const BoxSet& boxes, int threads, PairList& pairs) {
  if (boxes.size < 2) {
    pairs.clear(1);
    return 1;
  }
  const Triangle triangle = {boxes.size};
  const std::uint64_t count = triangle.pairs();
  const int parts =
      static_cast<int>(std::min<std::uint64_t>(threads, count / least_pairs_a_thread + 1));
  cells_.build(boxes, nullptr, boxes.size, parts);
  const TreeView& cells = cells_.view();
  const Kernels& kernel = kernels();
  pairs.clear(parts);
  int used = 1;
  runTeam(parts, [&](int thread, int team) {
    if (thread == 0) used = team;
    const ScopedMode mode(exactMode());
    for (int part = thread; part < parts; part += team) {
      BufferSink sink(pairs.parts[part]);
      const Range range = partOf(count, part, parts);
      std::uint64_t row = triangle.rowOf(range.begin);
      for (std::uint64_t pair = range.begin; pair < range.end; ++row) {
        const std::uint64_t row_begin = triangle.rowBegin(row);
        const std::uint64_t end = std::min<std::uint64_t>(range.end, triangle.rowBegin(row + 1));
        const std::uint64_t first_column = row + 1;
        kernel.rowPairs(cells, row, first_column + (pair - row_begin),
                        first_column + (end - row_begin), boxes.exact, sink);
        pair = end;
      }
    }
  });
  return used;
}

}  // namespace ode_parallel_sap
