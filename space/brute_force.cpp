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

template <class Real>
int BruteForce<Real>::find(const BoxSet& boxes, int threads, PairList& pairs) {
  if (boxes.size < 2) {
    pairs.clear(1);
    return 1;
  }
  const ScopedMode mode(exactMode());
  const Triangle triangle = {boxes.size};
  const std::uint64_t count = triangle.pairs();
  const int parts =
      static_cast<int>(std::min<std::uint64_t>(threads, count / least_pairs_a_thread + 1));
  const std::size_t cell_count = (boxes.size + group_size - 1) / group_size;
  starts_.resizeDiscarding(cell_count + 1);
  for (std::size_t i = 0; i < cell_count; ++i)
    starts_[i] = static_cast<std::uint32_t>(i * group_size);
  starts_[cell_count] = static_cast<std::uint32_t>(boxes.size);
  cells_.build(boxes, nullptr, starts_.data(), cell_count, parts,
               CellTree<Real>::Levels::cells_only);
  const TreeView<Real>& cells = cells_.view();
  const Kernels<Real>& kernel = kernels<Real>();
  pairs.clear(parts);
  int used = 1;
  runTeam(parts, [&](int thread, int team) {
    if (thread == 0) used = team;
    for (int part = thread; part < parts; part += team) {
      BufferSink sink(pairs.parts[part]);
      const Range range = partOf(count, part, parts);
      if (range.begin == range.end) continue;
      const std::uint64_t first = triangle.rowOf(range.begin), last = triangle.rowOf(range.end - 1);
      const TrianglePart rows = {boxes.size, first,
                                 first + 1 + (range.begin - triangle.rowBegin(first)), last,
                                 last + 1 + (range.end - triangle.rowBegin(last))};
      kernel.trianglePairs(cells, rows, boxes.exact, sink);
    }
  });
  for (std::size_t part = 0; part < pairs.parts.size() && !boxes.exact; ++part) {
    Pair all_bits = 0;
    for (const Pair pair : pairs.parts[part]) all_bits |= pair;
    if (isUnsure(all_bits)) pairs.unsure.push_back({part, 0, pairs.parts[part].size()});
  }
  return used;
}

template class BruteForce<float>;
template class BruteForce<double>;

}  // namespace ode_parallel_sap
