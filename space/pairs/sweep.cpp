#include "space/pairs/sweep.h"

#include <algorithm>
#include <atomic>

#include "space/base/floating_point.h"
#include "space/base/mechanisms.h"
#include "space/base/parallel.h"

namespace ode_parallel_sap {

// A round number: of a tree.
constexpr std::uint32_t sampled_nodes = 256;

static Region comparing("sweep: active boxes"), sweeping("sweep: tasks");

// Calls use(span) with the sum of extents of the cells of some nodes of all trees, in each frame
// the same; NaN where there is none.
template <class Real>
template <class Use>
void Sweep<Real>::forSpans(Use use) const {
  for (std::size_t i = 0; i < trees_.count(); ++i) {
    const TreeView<Real>& tree = trees_.views()[i];
    const std::uint32_t nodes = tree.depth ? tree.groups[1] : 0, step = nodes / sampled_nodes + 1;
    for (std::uint32_t node = 0; node < nodes; node += step) {
      const Group<Real>& cells = tree.levels[1][node];
      for (int lane = 0; lane < group_size; ++lane) {
        Real span = 0;
        for (int axis = 0; axis < 3; ++axis)
          span += cells.upper[axis][lane] - cells.lower[axis][lane];
        use(span);
      }
    }
  }
}

// Whether the cells of before hold all active slots and no others, and are not too old.
template <class Real>
bool Sweep<Real>::mayReuseCells(const BoxSet& boxes, int threads) {
  if (!mechanisms::kept_cells) return false;
  constexpr std::size_t word_slots = SlotSet::word_slots;
  const std::size_t words = (boxes.size + word_slots - 1) / word_slots;
  active_.growTo(boxes.size);
  std::atomic<bool> same{has_cells_ && size_ == boxes.size};
  size_ = boxes.size;
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  const int most = teamFor(words, grains::cells, threads);
  runTeam(comparing, most, [&](int thread, int team) {
    const Range range = ownPart(words, thread, team);
    for (std::size_t word = range.begin; word < range.end; ++word) {
      const std::size_t first = word * word_slots, count = std::min(boxes.size - first, word_slots);
      std::uint64_t bits = 0;
      for (std::size_t i = 0; i < count; ++i) bits |= std::uint64_t{isActive(box[first + i])} << i;
      if (bits == active_.word(word)) continue;
      active_.setWord(word, bits);
      same.store(false, std::memory_order_relaxed);
    }
  });
  return same && reuses_ < longest_reuse && !back_off_.skipTurn();
}

// Whether the cells, packed with the new boxes, have hardly grown: on average, as shares of what
// they were. What was infinite has not grown.
template <class Real>
bool Sweep<Real>::areGoodCells() {
  double growth = 0, count = 0;
  const Real* before = spans_.begin();
  forSpans([&](Real span) {
    growth += span > *before ? span / *before - 1 : 0;
    count += span == span;
    ++before;
  });
  const bool good = !(growth > most_growth * count);
  ++reuses_;
  good ? back_off_.paid() : back_off_.failed();
  return good;
}

template <class Real>
void Sweep<Real>::build(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace) {
  const ScopedMode mode(exactMode());
  packed_ = nullptr;
  bool are_good = mayReuseCells(boxes, threads);
  if (are_good) {
    trees_.build(boxes, order_, threads);
    are_good = areGoodCells();
  }
  if (!are_good) {
    has_cells_ = false;
    order_.build(boxes, threads, workspace);
    trees_.build(boxes, order_, threads);
    spans_.resizeDiscarding(0);
    forSpans([this](Real span) { spans_.push_back(span); });
    reuses_ = 0;
    has_cells_ = true;
  }
  packed_ = &boxes;
}

template <class Real>
int Sweep<Real>::find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) {
  const ScopedMode mode(exactMode());
  pairs.clear(1);
  build(boxes, threads, pairs.parts[0]);
  tasks_.clear();
  const std::size_t trees = trees_.count();
  const std::size_t share = trees_.cells() / (tasks_a_thread * threads) / group_size * group_size;
  const std::size_t task_cells = std::min(std::max(share, std::size_t{group_size}), chunk_searches);
  for (std::size_t own = 0; own < trees; ++own)
    for (std::size_t begin = 0, cells = trees_.cells(own); begin < cells; begin += task_cells)
      tasks_.push_back({trees_.views(), trees, own, begin, std::min(begin + task_cells, cells)});
  rows_.start(boxes.size, threads);
  const int used =
      runChunks(sweeping, threads, tasks_.size(), 1, [&](const Range& range, int thread) {
        kernels<Real>().findPairs(tasks_[range.begin], rows_.blocks(thread));
      });
  return std::max(used, rows_.writePairs(boxes.exact, threads, test, pairs));
}

template class Sweep<float>;
template class Sweep<double>;

}  // namespace ode_parallel_sap
