#include "space/cache/proxy_trees.h"

#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/pairs/radix_sort.h"
#include "space/simd/sink.h"

namespace ode_parallel_sap {

namespace {

Region meeting("proxy trees: cells");

}  // namespace

template <class Real>
void ProxyTrees<Real>::start(Sweep<Real>& base, std::size_t base_slots, const BoxSet& boxes) {
  base_ = &base;
  tree_of_slot_.resize(std::max(tree_of_slot_.size(), base_slots));
  if (!newest_) newest_ = std::make_unique<Trees>();
  if (!recent_) recent_ = std::make_unique<Trees>();
  startBase(boxes);
}

// All active boxes are in the base.
template <class Real>
void ProxyTrees<Real>::startBase(const BoxSet& boxes) {
  tree_of_slot_.resize(std::max(tree_of_slot_.size(), boxes.size));
  std::fill(tree_of_slot_.begin() + boxes.size, tree_of_slot_.end(), Tree::none);
  base_boxes_ = recent_boxes_ = 0;
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  for (std::size_t slot = 0; slot < boxes.size; ++slot) {
    const bool active = isActive(box[slot]);
    tree_of_slot_[slot] = active ? Tree::base : Tree::none;
    base_boxes_ += active;
  }
}

template <class Real>
void ProxyTrees<Real>::leaveTrees(const BoxSet& boxes, const Buffer<Slot>& changed) {
  const std::size_t before = tree_of_slot_.size();
  const auto leave = [this](std::size_t slot) {
    base_boxes_ -= tree_of_slot_[slot] == Tree::base;
    recent_boxes_ -= tree_of_slot_[slot] == Tree::recent;
    tree_of_slot_[slot] = Tree::none;
  };
  for (std::size_t slot = boxes.size; slot < before; ++slot) leave(slot);
  tree_of_slot_.growTo(boxes.size, Tree::none);  // trees may still name slots that are gone
  for (const Slot slot : changed) leave(slot);
}

template <class Real>
void ProxyTrees<Real>::gather(const BoxSet& boxes, const Buffer<Slot>& slots) {
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
int ProxyTrees<Real>::find(const BoxSet& boxes, const Buffer<Slot>& changed, int threads,
                           PairList& found) {
  const ScopedMode mode(exactMode());
  leaveTrees(boxes, changed);
  Buffer<Slot>& slots = newest_->slots;
  slots.resizeDiscarding(0);
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  for (const Slot slot : changed)
    if (isActive(box[slot])) slots.push_back(slot);
  found.clear(1);
  if (slots.size() == 0) return 1;
  threads = teamFor(slots.size(), grains::changed_boxes, threads);
  gather(boxes, slots);
  newest_->sweep.find(gathered_, threads, own_pairs_);
  newest_->sweep.renumber(slots.data());

  clearForTeam(found_, threads);
  int used = 1;
  if (base_boxes_) used = meet(*base_, Tree::base, boxes.exact, threads);
  if (recent_boxes_)
    used = std::max(used, meet(recent_->sweep, Tree::recent, boxes.exact, threads));
  for (const Buffer<Pair>& part : own_pairs_.parts)
    for (const Pair pair : part)
      found_[0].push_back(makePair(slots[earlierOf(pair)], slots[laterOf(pair)]) |
                          (pair & borderline_bit));
  sortPairs(found_, boxes.size, threads, workspace_, found);
  mergeNewest(boxes, threads);
  return used;
}

// Pairs of the newest boxes with those that live in the base or in the recent trees. The newest
// ones live in neither yet.
template <class Real>
int ProxyTrees<Real>::meet(const Sweep<Real>& other, Tree tree, bool exact, int threads) {
  tasks_.clear();
  const CellTrees<Real>&queries = newest_->sweep.trees(), &trees = other.trees();
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
            kernel.boxPairs(queries.views()[task.tree], task.begin, task.end, trees.views()[i],
                            exact, sink);
      }
    }
    const auto gone = [&](Pair pair) {
      return tree_of_slot_[earlierOf(pair)] != tree && tree_of_slot_[laterOf(pair)] != tree;
    };
    pairs.resize(std::remove_if(pairs.begin() + before, pairs.end(), gone) - pairs.begin());
  });
}

// Makes the newest boxes recent ones. What changed just now may well change again, so only those of
// before decide whether the base is made anew.
template <class Real>
void ProxyTrees<Real>::mergeNewest(const BoxSet& boxes, int threads) {
  if (recent_boxes_ * recent_share >= base_boxes_) {
    base_->build(boxes, threads, workspace_);
    return startBase(boxes);
  }
  Buffer<Slot>& slots = newest_->slots;
  if (recent_boxes_) {
    for (const Slot slot : recent_->slots)
      if (tree_of_slot_[slot] == Tree::recent) slots.push_back(slot);
    std::sort(slots.begin(), slots.end());
    gather(boxes, slots);
    newest_->sweep.build(gathered_, threads, workspace_);
    newest_->sweep.renumber(slots.data());
  }
  for (const Slot slot : slots) tree_of_slot_[slot] = Tree::recent;
  recent_boxes_ = slots.size();
  std::swap(newest_, recent_);
}

template class ProxyTrees<float>;
template class ProxyTrees<double>;

}  // namespace ode_parallel_sap
