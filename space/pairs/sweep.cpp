#include "space/pairs/sweep.h"

#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/simd/sink.h"

namespace ode_parallel_sap {

namespace {

Region sweeping("sweep: tasks");

}  // namespace

// Each class meets itself and all classes of larger boxes: a small cell reaches few of those.
template <class Real>
void Sweep<Real>::planTasks(const BoxSet& boxes, int threads) {
  tasks_.clear();
  const std::size_t trees = trees_.count();
  const std::size_t share = trees_.cells() / (tasks_a_thread * threads) / group_size * group_size;
  const std::size_t task_cells = std::min(std::max(share, std::size_t{group_size}), chunk_cells);
  for (std::size_t own = 0; own < trees; ++own)
    for (std::size_t begin = 0, cells = trees_.cells(own); begin < cells; begin += task_cells)
      tasks_.push_back(
          {trees_.views(), trees, own, begin, std::min(begin + task_cells, cells), boxes.exact});
}

template <class Real>
void Sweep<Real>::build(const BoxSet& boxes, int threads) {
  const ScopedMode mode(exactMode());
  ++builds_;
  if (cell_coherence_.mayReuse(boxes, threads)) {
    trees_.build(boxes, order_.boxesOfCells(), order_.classes(), threads);
    if (cell_coherence_.reuse(trees_)) return;
  }
  cell_coherence_.forget();
  if (found_.empty()) found_.resize(1);
  order_.build(boxes, threads, found_[0]);  // scratch memory until pairs are written
  trees_.build(boxes, order_.boxesOfCells(), order_.classes(), threads);
  cell_coherence_.restart(trees_);
}

template <class Real>
int Sweep<Real>::find(const BoxSet& boxes, int threads, PairList& pairs) {
  const ScopedMode mode(exactMode());
  releaseSpare(boxes.size);
  build(boxes, threads);
  planTasks(boxes, threads);

  clearForTeam(found_, threads);
  ChunkQueue queue(tasks_.size(), 1);
  const int used = runTeam(sweeping, threads, [&](int thread, int) {
    BufferSink sink(found_[thread]);
    for (Range range; queue.next(range);) kernels<Real>().cellPairs(tasks_[range.begin], sink);
  });
  pair_order_.sort(found_, boxes.size, threads, pairs);
  return used;
}

// Keeps what a frame like the last one needs, not what the way there took.
template <class Real>
void Sweep<Real>::releaseSpare(std::size_t slots) {
  const auto needed = [&](std::size_t thread) {
    const std::size_t last = found_[thread].size();
    const std::size_t pairs = std::max(last + last / 8, std::size_t{BufferSink::first_capacity});
    return thread == 0 ? std::max(pairs, 2 * slots) : pairs;  // boxes are sorted there
  };
  std::size_t all_held = 0, all_needed = 0;
  for (std::size_t thread = 0; thread < found_.size(); ++thread) {
    all_held += found_[thread].capacity();
    all_needed += needed(thread);
  }
  if (2 * all_held <= 3 * all_needed) return;
  for (std::size_t thread = 0; thread < found_.size(); ++thread) {
    const std::size_t enough = needed(thread);
    found_[thread].release();
    found_[thread].reserve(enough);
  }
}

template class Sweep<float>;
template class Sweep<double>;

}  // namespace ode_parallel_sap
