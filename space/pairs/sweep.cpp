#include "space/pairs/sweep.h"

#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region sweeping("sweep: tasks");

}  // namespace

template <class Real>
void Sweep<Real>::planTasks(int threads) {
  tasks_.clear();
  const std::size_t trees = trees_.count();
  const std::size_t share = trees_.cells() / (tasks_a_thread * threads) / group_size * group_size;
  const std::size_t task_cells = std::min(std::max(share, std::size_t{group_size}), chunk_searches);
  for (std::size_t own = 0; own < trees; ++own)
    for (std::size_t begin = 0, cells = trees_.cells(own); begin < cells; begin += task_cells)
      tasks_.push_back({trees_.views(), trees, own, begin, std::min(begin + task_cells, cells)});
}

template <class Real>
void Sweep<Real>::build(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace) {
  const ScopedMode mode(exactMode());
  if (cell_coherence_.mayReuse(boxes, threads)) {
    trees_.build(boxes, order_.boxesOfCells(), order_.classEnds(), threads);
    if (cell_coherence_.reuse(trees_)) return;
  }
  cell_coherence_.forget();
  order_.build(boxes, threads, workspace);
  trees_.build(boxes, order_.boxesOfCells(), order_.classEnds(), threads);
  cell_coherence_.restart(trees_);
}

template <class Real>
int Sweep<Real>::find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) {
  const ScopedMode mode(exactMode());
  pairs.clear(1);
  build(boxes, threads, pairs.parts[0]);
  planTasks(threads);
  rows_.start(boxes.size, threads);
  const int used =
      runChunks(sweeping, threads, tasks_.size(), 1, [&](const Range& range, int thread) {
        kernels<Real>().findPairs(tasks_[range.begin], rows_.space(thread));
      });
  return std::max(used, rows_.writePairs(boxes.exact, threads, test, pairs));
}

template class Sweep<float>;
template class Sweep<double>;

}  // namespace ode_parallel_sap
