#include <algorithm>
#include <atomic>

#include "space/base/mechanisms.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/pairs/sweep.h"

namespace ode_parallel_sap {

namespace {

Region comparing("cell coherence: active boxes");

// Lists the sums of extents of what is right below the nodes of a level of all trees. Not a number
// where there is nothing.
template <class Real>
void listSpans(const CellTrees<Real>& trees, int level, Buffer<Real>& spans) {
  spans.resizeDiscarding(0);
  for (std::size_t i = 0; i < trees.count(); ++i) {
    const TreeView<Real>& tree = trees.views()[i];
    for (std::uint32_t node = 0; level < tree.depth && node < tree.groups[level]; ++node) {
      const Group<Real>& bounds = tree.levels[level][node];
      spans.resize(spans.size() + group_size);
      for (int lane = 0; lane < group_size; ++lane) {
        Real span = 0;
        for (int axis = 0; axis < 3; ++axis)
          span += bounds.upper[axis][lane] - bounds.lower[axis][lane];
        spans.end()[lane - group_size] = span;
      }
    }
  }
}

// Whether they have grown much on average, as shares of what they were. What was infinite has not
// grown.
template <class Real>
bool haveGrown(const Buffer<Real>& spans, const Buffer<Real>& before) {
  double growth = 0, count = 0;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    growth += spans[i] > before[i] ? spans[i] / before[i] - 1 : 0;
    count += spans[i] == spans[i];
  }
  return growth > most_growth * count;
}

}  // namespace

template <class Real>
bool CellCoherence<Real>::mayReuse(const BoxSet& boxes, int threads) {
  if (!mechanisms::kept_cells) return false;
  constexpr std::size_t word_slots = SlotSet::word_slots;
  const std::size_t words = (boxes.size + word_slots - 1) / word_slots;
  active_.growTo(boxes.size);
  std::atomic<bool> same{known_ && size_ == boxes.size};
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

template <class Real>
bool CellCoherence<Real>::reuse(const CellTrees<Real>& trees) {
  bool good = true;
  for (const int level : {1, 2}) {
    listSpans(trees, level, spans_);
    good = good && !haveGrown(spans_, spans_when_cut_[level - 1]);
  }
  ++reuses_;
  good ? back_off_.paid() : back_off_.failed();
  return good;
}

template <class Real>
void CellCoherence<Real>::restart(const CellTrees<Real>& trees) {
  for (const int level : {1, 2}) listSpans(trees, level, spans_when_cut_[level - 1]);
  reuses_ = 0;
  known_ = true;
}

template class CellCoherence<float>;
template class CellCoherence<double>;

}  // namespace ode_parallel_sap
