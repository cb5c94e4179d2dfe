// The trees over the geoms of a space, which pairs of few geoms, queries and rays walk.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/tuning.h"
#include "space/geoms/pair_rule.h"
#include "space/pairs/cell_trees.h"
#include "space/pairs/sweep.h"

struct dxGeom;

namespace ode_parallel_sap {

// CellTrees that are kept where queries come often enough to pay for them. The search of a changed
// geom's pairs is a query, too. Counts of changed geoms and of queries decide, never times. The
// trees of sweeps made frames of 10,000 moving spheres with 10 and 100 rays after each 2.7 and 1.2
// times faster, of 100,000 2.2 and 1.3 times.
//
// The space calls changed() for every geom that is added, is removed or becomes dirty, and reset()
// where slots are numbered anew. Bits, bodies and enabled states change without notice, so they are
// read from the geoms that a query finds.
//
// Where nothing changes, any number of threads may read the tree while one of them, the keeper,
// calls bringUpToDate() and find(). It does not change the tree while others read it.
class GeomTree {
 public:
  using Geoms = Buffer<dxGeom*>;  // by slot, null where there is none
  // Rays meet geoms of the first kind along their way, of the other one by their boxes.
  enum Kind { bounded, other, kinds };

  void changed(std::size_t slot) {
    ++changes_;
    if (tree_.all_changed) return;
    Buffer<Slot>& changed = tree_.changed;
    tree_.all_changed = changed.size() == changed.capacity();
    if (!tree_.all_changed) changed.push_back(static_cast<Slot>(slot));
  }
  void reset() {
    tree_.built = false;
    is_open_.store(false, std::memory_order_relaxed);
  }

  // Takes the trees of a sweep that just found pairs, but for those of so many geoms `left_out`, if
  // queries are likely and to bring these up to date costs less. Throws std::bad_alloc.
  void takeFrom(Sweep<float>& sweep, const Geoms& geoms, std::size_t left_out);

  // Brings dirty geoms up to date if it knows them and they are few. False: the space has to.
  bool clean(const Geoms& geoms);
  // A reader that is not the keeper.
  class Reader {
   public:
    explicit Reader(const GeomTree& tree) : tree_(tree) {
      tree.readers_.fetch_add(1);
      may_read_ = tree.is_open_.load() && tree.tree_.isCurrent();
    }
    Reader(const Reader& other) : tree_(other.tree_), may_read_(other.may_read_) {
      tree_.readers_.fetch_add(1);
    }
    ~Reader() { tree_.readers_.fetch_sub(1, std::memory_order_release); }
    Reader& operator=(const Reader&) = delete;

    // Whether the tree is up to date.
    bool mayRead() const { return may_read_; }

   private:
    const GeomTree& tree_;
    bool may_read_;
  };

  // Makes the tree ready for so many queries more. False where others read it, or, unless they
  // `must` go by it, where they cost less without one. All AABBs are up to date. Throws
  // std::bad_alloc.
  bool bringUpToDate(const Geoms& geoms, int threads, std::size_t queries = 1, bool must = false);

  // Calls work(trees) with the CellTrees of both kinds, of floats or doubles.
  template <class Work>
  auto withTrees(Work work) const {
    return tree_.is_wide ? work(tree_.wide) : work(tree_.narrow);
  }

  // Leaves in `found` the slots of the geoms, from the first kind on, whose AABBs overlap that of
  // `geom`, each once, in no order. The tree is up to date. Needs exactMode(); may run on many
  // threads at once. Throws std::bad_alloc.
  void find(const Geoms& geoms, const dxGeom* geom, Buffer<Slot>& found,
            Kind first = bounded) const;

  // Each geom that has no NaN is in the tree of its kind, by the box of its AABB.
  void validate(const Geoms& geoms) const;

  // A frame went by: a tree that no query used in many of them is given back. Whether it was.
  bool noteFrame() {
    if (idle_frames_ == idle_frames || ++idle_frames_ < idle_frames) return false;
    release();
    return true;
  }

  // Gives back all that is held, if nobody reads it.
  void release() {
    if (close()) tree_ = Tree();
  }
  std::size_t bytes() const { return bytesOf(tree_); }

 private:
  struct Tree {
    bool built = false;
    bool is_wide = false;  // boxes of doubles; of floats where these are fine enough
    // The trees of bounded geoms are still a sweep's, of geoms of both kinds without those that it
    // left out.
    bool is_taken = false;
    bool all_changed = false;
    Buffer<Slot> changed;   // since the tree was up to date, unless all_changed; some twice
    std::size_t slots = 0;  // when the tree was up to date
    // Slots that are left to one thread, by thread that left them.
    std::vector<Buffer<Slot>> apart;
    SlotSet seen;  // by one of the threads
    CellTrees<float> narrow[kinds];
    CellTrees<double> wide[kinds];

    template <class Work>
    auto withTrees(Work work) {
      return is_wide ? work(wide) : work(narrow);
    }
    template <class Real>
    std::size_t pack(const Geoms& geoms, int threads, BoxSet (&boxes)[kinds]);
    void build(const Geoms& geoms, int threads);
    template <class SlotAt, class Stays>
    bool place(std::size_t count, SlotAt slotAt, const Geoms& geoms, int threads, double most_rows,
               Stays stays);
    bool refresh(const Geoms& geoms, int threads, double most_rows);
    void setUpToDate(std::size_t slots);
    std::size_t strayRows() {
      return withTrees([](auto& of) { return of[bounded].strayRows() + of[other].strayRows(); });
    }
    bool isCurrent() const { return built && !is_taken && !all_changed && changed.size() == 0; }
    std::size_t bytes() const { return bytesOf(changed, apart, seen, narrow, wide); }
  };

  // Before a change: false where others read the tree. They count themselves, then see it closed.
  bool close() {
    const bool was_open = is_open_.exchange(false);
    const bool closed = readers_.load() == 0;
    if (was_open && !closed) is_open_.store(true, std::memory_order_release);
    return closed;
  }

  Tree tree_;
  mutable std::atomic<int> readers_{0};
  std::atomic<bool> is_open_{false};
  int idle_frames_ = 0;
  double changes_ = 0;       // since the last query
  double queries_ = 0;       // since a great part of the geoms changed
  double last_queries_ = 0;  // between the two great changes before
  double stray_rows_ = 0;    // gone through by all queries since the tree was built
  BackOff back_off_{2};      // where most geoms leave their cells between queries
  BackOff taking_{2};        // where most geoms change between a sweep and the queries
};

// The tree of a sub-space without further spaces in it, up to date.
struct NestedTree {
  Slot slot;  // of the sub-space
  const GeomTree& tree;
  const GeomTree::Geoms& geoms;
  GeomTree::Reader reader;
};
using NestedTrees = std::vector<NestedTree>;  // ascending by slot

// Null if it is not among them.
inline const NestedTree* nestedAt(const NestedTrees& nested, Slot slot) {
  if (nested.empty()) return nullptr;
  const auto found =
      std::lower_bound(nested.begin(), nested.end(), slot,
                       [](const NestedTree& each, Slot slot) { return each.slot < slot; });
  return found != nested.end() && found->slot == slot ? &*found : nullptr;
}

// The program's own word on which geoms, none of them spaces, the queries of a batch may meet.
struct QueryFilter {
  dParallelSAPQueryFilter* function = nullptr;
  void* data = nullptr;
};

// What a query found, in storage that is kept between queries, so that none of them allocates.
struct QueryLists {
  Buffer<dxGeom*> hits;
  Buffer<Slot> found;  // in the end those of the hits
  SlotSet marks;       // empty between queries

  std::size_t bytes() const { return bytesOf(hits, found, marks); }
};

// Puts into the hits, in ascending order of their slots, the enabled geoms that are pairs with
// `geom` by the rules of queries, the AABBTest calls apart. All AABBs are up to date, that of
// `geom` is without NaN. By the tree, or without one geom by geom. Needs exactMode(); may run on
// many threads at once. Throws std::bad_alloc.
void findHits(const GeomTree* tree, const GeomTree::Geoms& geoms, dxGeom* geom,
              const PairRules& rules, QueryLists& lists);

// So few geoms are tested in one pass, without lists or a tree.
constexpr std::size_t few_geoms = 16;
// The slots of so few that are hits: a bit each.
inline std::uint32_t findFew(const GeomTree::Geoms& geoms, dxGeom* geom, const PairRules& rules) {
  const ScopedMode mode(exactMode());
  std::uint32_t hits = 0, bit = 1;
  for (dxGeom* const own : geoms) {
    if (own && boxesOverlap(own, geom) && rules.isHit(own, geom)) hits |= bit;
    bit <<= 1;
  }
  return hits;
}

}  // namespace ode_parallel_sap
