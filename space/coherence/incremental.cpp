#include "space/coherence/incremental.h"

#include <algorithm>

#include "space/coherence/tuning.h"
#include "space/data/floating_point.h"
#include "space/data/mechanisms.h"
#include "space/data/parallel.h"
#include "space/data/tuning.h"
#include "space/simd/sink.h"

namespace ode_parallel_sap {

namespace {

constexpr std::uint8_t no_tree = 0xff;

Region meeting("incremental: cells");

}  // namespace

template <class Real>
void Incremental<Real>::start(Sweep<Real>& base, std::size_t base_slots, const BoxSet& boxes) {
  base_ = &base;
  tree_of_slot_.resize(std::max(tree_of_slot_.size(), base_slots));
  startBase(boxes);
}

// All active boxes are in the base.
template <class Real>
void Incremental<Real>::startBase(const BoxSet& boxes) {
  // No level may be left behind empty where there is no memory.
  spare_levels_.reserve(spare_levels_.size() + levels_.size());
  for (std::unique_ptr<Level>& level : levels_) spare_levels_.push_back(std::move(level));
  levels_.clear();
  tree_of_slot_.resize(std::max(tree_of_slot_.size(), boxes.size));
  std::fill(tree_of_slot_.begin() + boxes.size, tree_of_slot_.end(), no_tree);
  base_live_ = 0;
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  for (std::size_t slot = 0; slot < boxes.size; ++slot) {
    const bool active = isActive(box[slot]);
    tree_of_slot_[slot] = active ? 0 : no_tree;
    base_live_ += active;
  }
}

template <class Real>
std::unique_ptr<typename Incremental<Real>::Level> Incremental<Real>::newLevel() {
  if (spare_levels_.empty()) return std::make_unique<Level>();
  std::unique_ptr<Level> level = std::move(spare_levels_.back());
  spare_levels_.pop_back();
  return level;
}

// Slots that changed live nowhere for now, nor do those that are no more.
template <class Real>
void Incremental<Real>::leaveTrees(const BoxSet& boxes, const Buffer<Slot>& changed) {
  const std::size_t before = tree_of_slot_.size();
  const auto leave = [this](std::size_t slot) {
    TreeNumber& tree = tree_of_slot_[slot];
    if (tree == 0)
      --base_live_;
    else if (tree != no_tree)
      --levels_[tree - 1]->live;
    tree = no_tree;
  };
  for (std::size_t slot = boxes.size; slot < before; ++slot) leave(slot);
  tree_of_slot_.growTo(boxes.size, no_tree);  // trees may still name slots that are gone
  for (const Slot slot : changed) leave(slot);
}

template <class Real>
void Incremental<Real>::gather(const BoxSet& boxes, const Buffer<Slot>& slots) {
  const std::size_t count = slots.size();
  gathered_.size = count;
  gathered_.wide = boxes.wide;
  gathered_.filter_bits = boxes.filter_bits;
  gathered_.filter_bodies = boxes.filter_bodies;
  gathered_.exact = boxes.exact;
  Buffer<BasicBox<Real>>& gathered_boxes = boxBufferOf<Real>(gathered_);
  gathered_boxes.resizeDiscarding(count);
  gathered_.bits.resizeDiscarding(count);
  gathered_.bodies.resizeDiscarding(count);
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  for (std::size_t i = 0; i < count; ++i) {
    gathered_boxes[i] = box[slots[i]];
    gathered_.bits[i] = boxes.bits[slots[i]];
    gathered_.bodies[i] = boxes.bodies[slots[i]];
  }
}

template <class Real>
int Incremental<Real>::find(const BoxSet& boxes, const Buffer<Slot>& changed, int threads,
                            PairList& found) {
  const ScopedMode mode(exactMode());
  leaveTrees(boxes, changed);
  std::unique_ptr<Level> newest = newLevel();
  newest->slots.resizeDiscarding(0);
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  for (const Slot slot : changed)
    if (isActive(box[slot])) newest->slots.push_back(slot);
  found.clear(1);
  if (newest->slots.size() == 0) {
    spare_levels_.push_back(std::move(newest));
    return 1;
  }
  threads = teamFor(newest->slots.size(), grains::changed_boxes, threads);
  gather(boxes, newest->slots);
  newest->sweep.find(gathered_, threads, own_pairs_);
  const Slot* const slots = newest->slots.data();
  newest->sweep.renumber(slots);

  clearForTeam(found_, threads);
  int used = 1;
  if (base_live_) used = meetLevel(newest->sweep, *base_, 0, boxes.exact, threads);
  for (std::size_t i = 0; i < levels_.size(); ++i)
    if (levels_[i]->live)
      used = std::max(used, meetLevel(newest->sweep, levels_[i]->sweep,
                                      static_cast<TreeNumber>(i + 1), boxes.exact, threads));
  for (const Buffer<Pair>& part : own_pairs_.parts)
    for (const Pair pair : part)
      found_[0].push_back(makePair(slots[earlierOf(pair)], slots[laterOf(pair)]) |
                          (pair & borderline_bit));
  pair_order_.sort(found_, boxes.size, threads, found);
  settle(boxes, std::move(newest), threads);
  return used;
}

// Pairs of the newest level's boxes with those that live in another one. Of the two slots the
// newest level's has no tree yet.
template <class Real>
int Incremental<Real>::meetLevel(const Sweep<Real>& newest, const Sweep<Real>& level,
                                 TreeNumber tree, bool exact, int threads) {
  tasks_.clear();
  const CellTrees<Real>&queries = newest.trees(), &trees = level.trees();
  for (std::size_t i = 0; i < queries.count(); ++i) {
    const std::size_t cells = queries.cells(i);
    const std::size_t task_cells = chunkOf(cells, changed_chunk_cells, threads);
    for (std::size_t begin = 0; begin < cells; begin += task_cells)
      tasks_.push_back({i, begin, std::min(begin + task_cells, cells)});
  }
  const Kernels<Real>& kernel = kernels<Real>();
  ChunkQueue queue(tasks_.size(), 1);
  return runTeam(meeting, threads, [&](int thread, int) {
    Buffer<Pair>& pairs = found_[thread];
    const std::size_t before = pairs.size();
    {
      BufferSink sink(pairs);
      for (Range range; queue.next(range);) {
        const Task& task = tasks_[range.begin];
        for (std::size_t i = 0; i < trees.count(); ++i)
          if (trees.cells(i))
            kernel.boxPairs(queries.views()[task.queries], task.begin, task.end, trees.views()[i],
                            exact, sink);
      }
    }
    const auto gone = [&](Pair pair) {
      return tree_of_slot_[earlierOf(pair)] != tree && tree_of_slot_[laterOf(pair)] != tree;
    };
    pairs.resize(std::remove_if(pairs.begin() + before, pairs.end(), gone) - pairs.begin());
  });
}

// Gives the newest level its place, together with the levels that it has come near in size.
template <class Real>
void Incremental<Real>::settle(const BoxSet& boxes, std::unique_ptr<Level> newest, int threads) {
  // What changed just now may well change again.
  std::size_t at_rest = 0, merged = 0;
  for (const std::unique_ptr<Level>& level : levels_) at_rest += level->live;
  if (at_rest * level_ratio >= base_live_) {
    base_->build(boxes, threads);
    spare_levels_.push_back(std::move(newest));
    startBase(boxes);
    return;
  }
  while (!levels_.empty() &&
         (!mechanisms::tree_levels || levels_.back()->live <= level_ratio * newest->slots.size())) {
    const TreeNumber tree = static_cast<TreeNumber>(levels_.size());
    const Level& level = *levels_.back();
    if (level.live)
      for (const Slot slot : level.slots)
        if (tree_of_slot_[slot] == tree) newest->slots.push_back(slot);
    merged += level.live;
    spare_levels_.push_back(std::move(levels_.back()));
    levels_.pop_back();
  }
  if (merged) {
    std::sort(newest->slots.begin(), newest->slots.end());
    gather(boxes, newest->slots);
    newest->sweep.build(gathered_, threads);
    newest->sweep.renumber(newest->slots.data());
  }
  newest->live = newest->slots.size();
  const TreeNumber tree = static_cast<TreeNumber>(levels_.size() + 1);
  for (const Slot slot : newest->slots) tree_of_slot_[slot] = tree;
  levels_.push_back(std::move(newest));
}

template class Incremental<float>;
template class Incremental<double>;

}  // namespace ode_parallel_sap
