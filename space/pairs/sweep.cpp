#include "space/pairs/sweep.h"

#include <algorithm>
#include <atomic>
#include <numeric>

#include "space/base/floating_point.h"
#include "space/base/mechanisms.h"
#include "space/base/parallel.h"

namespace ode_parallel_sap {

static Region comparing("sweep: active boxes"), sweeping("sweep: tasks");

// Calls use(spans) for each node of all trees: the sums of extents of its cells, NaN for none.
template <class Real>
template <class Use>
void Sweep<Real>::forSpans(Use use) const {
  for (std::size_t i = 0; i < trees_.count(); ++i) {
    const TreeView<Real>& tree = trees_.views()[i];
    for (std::uint32_t node = 0; tree.depth && node < tree.groups[1]; ++node) {
      const Group<Real>& cells = tree.levels[1][node];
      Real spans[group_size] = {};
      for (int axis = 0; axis < 3; ++axis)
        for (int lane = 0; lane < group_size; ++lane)
          spans[lane] += cells.upper[axis][lane] - cells.lower[axis][lane];
      use(spans);
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
  Real growths[group_size] = {}, counts[group_size] = {};  // sums, by lane
  const Real* before = spans_.begin();
  forSpans([&](const Real* spans) {
    for (int lane = 0; lane < group_size; ++lane) {
      const Real growth = spans[lane] / before[lane] - 1;
      growths[lane] += growth > 0 ? growth : 0;
      counts[lane] += spans[lane] == spans[lane] ? 1 : 0;
    }
    before += group_size;
  });
  const double growth = std::accumulate(growths, growths + group_size, 0.0);
  const double count = std::accumulate(counts, counts + group_size, 0.0);
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
    forSpans([this](const Real* spans) {
      spans_.resize(spans_.size() + group_size);
      std::copy(spans, spans + group_size, spans_.end() - group_size);
    });
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
  const std::size_t share = taskSize(trees_.cells(), threads) / group_size * group_size;
  const std::size_t task_cells = std::clamp<std::size_t>(share, group_size, chunk_searches);
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
