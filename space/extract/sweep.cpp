#include "space/extract/sweep.h"

#include <algorithm>

#include "space/data/floating_point.h"
#include "space/data/mechanisms.h"
#include "space/data/parallel.h"
#include "space/data/tuning.h"
#include "space/simd/sink.h"

namespace ode_parallel_sap {

namespace {

Region sweeping("sweep: tasks");

}  // namespace

// Each class meets itself and all classes of larger boxes: a small cell reaches few of those. What
// the bits of whole classes decide is not asked of their boxes.
template <class Real>
void Sweep<Real>::planTasks(const BoxSet& boxes, int threads) {
  tasks_.clear();
  std::size_t all = 0;
  for (std::size_t i = 0; i < order_.classes().size(); ++i) all += trees_[i].cells();
  const std::size_t share = all / (tasks_a_thread * threads) / group_size * group_size;
  const std::size_t task_cells = std::min(std::max(share, std::size_t{group_size}), chunk_cells);
  const std::uint32_t classes = static_cast<std::uint32_t>(order_.classes().size());
  for (std::uint32_t queries = 0; queries < classes; ++queries)
    for (std::uint32_t tree = queries; tree < classes; ++tree) {
      const std::size_t cells = trees_[queries].cells();
      if (trees_[tree].cells() == 0) continue;
      bool filtered = boxes.filter_bits || boxes.filter_bodies;
      if (mechanisms::filters_of_classes && filtered) {
        const FilterSummary &a = trees_[queries].filters(), &b = trees_[tree].filters();
        if (!someMayMeet(a, b)) continue;
        filtered = boxes.filter_bodies || !allMayMeet(a, b);
      }
      for (std::size_t begin = 0; begin < cells; begin += task_cells)
        tasks_.push_back({queries, tree, filtered, begin, std::min(begin + task_cells, cells)});
    }
}

template <class Real>
void Sweep<Real>::build(const BoxSet& boxes, int threads) {
  const ScopedMode mode(exactMode());
  ++builds_;
  kept_cells_ = cell_coherence_.mayServe(boxes, threads);
  if (kept_cells_) {
    packTrees(boxes, threads);
    kept_cells_ = cell_coherence_.serve(trees_, trees());
    if (kept_cells_) return;
  }
  cell_coherence_.forget();
  if (found_.empty()) found_.resize(1);
  order_.build(boxes, threads, found_[0]);  // where pairs will be
  packTrees(boxes, threads);
  cell_coherence_.restart(trees_, trees());
}

template <class Real>
void Sweep<Real>::packTrees(const BoxSet& boxes, int threads) {
  const std::vector<typename CellOrder<Real>::Class>& classes = order_.classes();
  if (trees_.size() < classes.size()) trees_.resize(classes.size());
  for (std::size_t i = 0; i < classes.size(); ++i)
    trees_[i].build(boxes, order_.order(), order_.starts() + classes[i].first_cell,
                    classes[i].last_cell - classes[i].first_cell, threads);
}

template <class Real>
void Sweep<Real>::renumber(const Slot* slots) {
  for (std::size_t i = 0; i < trees(); ++i) trees_[i].renumber(slots);
}

template <class Real>
void Sweep<Real>::run(const Task& task, bool exact, PairSink& sink) const {
  const Kernels<Real>& kernel = kernels<Real>();
  TreeView<Real> queries = trees_[task.queries].view(), tree = trees_[task.tree].view();
  if (!task.filtered) queries.filters = tree.filters = nullptr;
  if (task.queries == task.tree)
    kernel.selfPairs(queries, task.begin, task.end, exact, sink);
  else
    kernel.crossPairs(queries, task.begin, task.end, tree, exact, sink);
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
    for (Range range; queue.next(range);) run(tasks_[range.begin], boxes.exact, sink);
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
  if (2 * all_held > 3 * all_needed)
    for (std::size_t thread = 0; thread < found_.size(); ++thread)
      found_[thread].clearTo(needed(thread));
}

template class Sweep<float>;
template class Sweep<double>;

}  // namespace ode_parallel_sap
