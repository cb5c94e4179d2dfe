#include "space/pairs/cell_coherence.h"

#include <algorithm>
#include <utility>

#include "space/base/mechanisms.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region comparing("cell coherence: active boxes");

// Sums of the extents of what is below a node. Not a number where there is nothing.
template <class Real>
void spansOf(const Group<Real>& bounds, Real* spans) {
  for (int lane = 0; lane < group_size; ++lane) {
    spans[lane] = 0;
    for (int axis = 0; axis < 3; ++axis)
      spans[lane] += bounds.upper[axis][lane] - bounds.lower[axis][lane];
  }
}

// Calls visit() for the nodes of a level of all trees that have it, and returns how many cells or
// nodes are right below them.
template <class Real, class Visit>
std::size_t forNodes(const CellTrees<Real>& trees, int level, Visit visit) {
  std::size_t children = 0;
  for (std::size_t i = 0; i < trees.count(); ++i) {
    const TreeView<Real>& tree = trees.views()[i];
    if (level >= tree.depth) continue;
    for (std::uint32_t node = 0; node < tree.groups[level]; ++node) visit(tree.levels[level][node]);
    children += tree.groups[level - 1];
  }
  return children;
}

// Sum over what is below a node of how much it has grown, as shares of what they were. What was
// infinite has not grown.
template <class Real>
double growthOf(const Group<Real>& bounds, const Real* before) {
  alignas(64) Real spans[group_size];
  spansOf(bounds, spans);
  Real growth = 0;
  for (int lane = 0; lane < group_size; ++lane)
    growth += spans[lane] > before[lane] ? spans[lane] / before[lane] - 1 : 0;
  return growth;
}

}  // namespace

template <class Real>
bool CellCoherence<Real>::mayReuse(const BoxSet& boxes, int threads) {
  if (!mechanisms::kept_cells) return false;
  constexpr std::size_t word_slots = SlotSet::word_slots;
  const std::size_t words = (boxes.size + word_slots - 1) / word_slots;
  seen_.growTo(boxes.size);
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  const int most = teamFor(words, grains::box_rows, threads);
  runTeam(comparing, most, [&](int thread, int team) {
    const Range range = ownPart(words, thread, team);
    for (std::size_t word = range.begin; word < range.end; ++word) {
      const std::size_t first = word * word_slots, count = std::min(boxes.size - first, word_slots);
      std::uint64_t bits = 0;
      for (std::size_t i = 0; i < count; ++i) bits |= std::uint64_t{isActive(box[first + i])} << i;
      seen_.setWord(word, bits);
    }
  });
  if (!known_ || size_ != boxes.size) {
    size_ = boxes.size;
    return false;
  }
  if (back_off_.waits()) {
    back_off_.pass();
    return false;
  }
  bool same = true;
  for (std::size_t word = 0; word < words; ++word)
    same = same && seen_.word(word) == active_.word(word);
  return reuses_ < longest_reuse && same;
}

template <class Real>
bool CellCoherence<Real>::reuse(const CellTrees<Real>& trees) {
  const Real* before = spans_.data();
  bool good = true;
  for (const int level : {1, 2}) {
    double growth = 0;
    const std::size_t children = forNodes(trees, level, [&](const Group<Real>& bounds) {
      growth += growthOf(bounds, before);
      before += group_size;
    });
    good = good && growth <= most_growth * static_cast<double>(children);
  }
  if (good) {
    if (++reuses_ > 1) back_off_.paid();
    return true;
  }
  known_ = false;
  if (reuses_ == 0) back_off_.failed();
  return false;
}

template <class Real>
void CellCoherence<Real>::restart(const CellTrees<Real>& trees) {
  spans_.resizeDiscarding(0);
  for (const int level : {1, 2})
    forNodes(trees, level, [&](const Group<Real>& bounds) {
      spans_.resize(spans_.size() + group_size);
      spansOf(bounds, spans_.end() - group_size);
    });
  std::swap(active_, seen_);
  reuses_ = 0;
  known_ = true;
}

template class CellCoherence<float>;
template class CellCoherence<double>;

}  // namespace ode_parallel_sap
