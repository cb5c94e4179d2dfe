#include "space/queries/geom_tree.h"

#include <limits>
#include <type_traits>

#include "space/base/floating_point.h"
#include "space/base/mechanisms.h"
#include "space/base/parallel.h"
#include "space/base/round_to_floats.h"
#include "space/base/validate.h"
#include "space/geoms/geom_tests.h"
#include "space/queries/ray_bounds.h"

namespace ode_parallel_sap {

namespace {

Region packing("geom tree: boxes"), moving("geom tree: moved boxes");

dxGeom* geomAt(const Buffer<dxGeom*>& geoms, std::size_t slot) {
  return slot < geoms.size() ? geoms[slot] : nullptr;
}

// A geom's box, all NaN where it takes part in nothing. `coarse`: floats make it clearly larger.
template <class Real>
BasicBox<Real> boxOf(const dxGeom* geom, bool* coarse = nullptr) {
  constexpr BasicBox<Real> none = inactiveBox<Real>();
  if (!geom) return none;
  if constexpr (sizeof(Real) == sizeof(float)) {
    Box box;
    const BoundsFacts facts = roundToFloats(geom->aabb, box);
    if (coarse) *coarse = facts & coarse_bounds;
    return facts & nan_bounds ? none : box;
  } else {
    return hasNaN(geom) ? none : boxOfBounds<Real>(geom->aabb);
  }
}

template <class Tree>
using RealOf = typename std::remove_reference_t<Tree>::RealType;

using Geoms = GeomTree::Geoms;

// Few hits are sorted. Many are marked in a set, which is in order.
void findByTree(const GeomTree& tree, const Geoms& geoms, const dxGeom* geom, QueryLists& lists) {
  Buffer<dxGeom*>& hits = lists.hits;
  Buffer<Slot>& found = lists.found;
  tree.find(geoms, geom, found);
  hits.resizeDiscarding(found.size());
  dxGeom** next = hits.data();
  const auto add = [&](Slot slot) {
    dxGeom* const own = geoms[slot];
    prefetchState(own);
    *next++ = own;
  };
  if (found.size() < geoms.size() / many_hits + few_hits) {
    std::sort(found.begin(), found.end());
    std::for_each(found.begin(), found.end(), add);
    return;
  }
  lists.marks.growTo(geoms.size());
  for (const Slot slot : found) lists.marks.insert(slot);
  lists.marks.forEach(add);
  lists.marks.clear();
}

void findByTests(const Geoms& geoms, const dxGeom* geom, Buffer<dxGeom*>& hits) {
  hits.resizeDiscarding(0);
  for (std::size_t slot = 0; slot < geoms.size(); ++slot) {
    if (slot + prefetch_distance < geoms.size())
      if (const dxGeom* const later = geoms[slot + prefetch_distance]) {
        prefetchState(later);
        prefetchBounds(later);
      }
    dxGeom* const own = geoms[slot];
    if (own && boxesOverlap(own, geom)) hits.push_back(own);
  }
}

}  // namespace

// Returns how many boxes floats make clearly larger.
template <class Real>
std::size_t GeomTree::Tree::pack(const Geoms& geoms, int threads, BoxSet (&boxes)[kinds]) {
  for (BoxSet& set : boxes) set.wide = sizeof(Real) > sizeof(float);
  Buffer<BasicBox<Real>>& all = boxBufferOf<Real>(boxes[bounded]);
  all.resizeDiscarding(boxes[bounded].size = geoms.size());
  std::atomic<std::size_t> count{0};
  const int most = teamFor(geoms.size(), grains::slots, threads);
  clearForTeam(apart, most);
  runTeam(packing, most, [&](int thread, int team) {
    std::size_t own_count = 0;
    const Range own = ownPart(geoms.size(), thread, team);
    for (std::size_t slot = own.begin; slot < own.end; ++slot) {
      if (const dxGeom* const later = geomAt(geoms, slot + prefetch_distance))
        prefetchBounds(later);
      const dxGeom* const geom = geoms[slot];
      bool coarse = false;
      all[slot] = boxOf<Real>(geom, &coarse);
      own_count += coarse;
      if (geom && !hasBoundedHits(geom)) apart[thread].push_back(static_cast<Slot>(slot));
    }
    count += own_count;
  });
  boxes[other].size = 0;
  for (const Buffer<Slot>& part : apart)
    for (const Slot slot : part) {
      Buffer<BasicBox<Real>>& others = boxBufferOf<Real>(boxes[other]);
      if (!boxes[other].size) {
        others.resizeDiscarding(boxes[other].size = geoms.size());
        std::fill(others.begin(), others.end(), inactiveBox<Real>());
      }
      std::swap(others[slot], all[slot]);
    }
  return count;
}

void GeomTree::Tree::build(const Geoms& geoms, int threads) {
  built = is_taken = false;
  BoxSet boxes[kinds];
  // A small part of them will do as floats.
  is_wide = pack<float>(geoms, threads, boxes) > geoms.size() / 8 && sizeof(dReal) > sizeof(float);
  if (is_wide) pack<double>(geoms, threads, boxes);
  for (int kind = 0; kind < kinds; ++kind)
    if (is_wide)
      narrow[kind] = {};
    else
      wide[kind] = {};
  withTrees([&](auto& of) {
    for (int kind = 0; kind < kinds; ++kind) of[kind].build(boxes[kind], threads);
  });
  setUpToDate(geoms.size());
  built = true;
}

void GeomTree::Tree::setUpToDate(std::size_t slots_now) {
  changed.reserve(static_cast<std::size_t>(static_cast<double>(slots_now) / refresh_cost) + 1);
  changed.resizeDiscarding(0);
  slots = slots_now;
  all_changed = false;
  is_taken = false;
}

// Places the geoms of slots: all threads those that stay(trees, slot, geom) where they are, one the
// others. False once there are more rows of strays than that.
template <class SlotAt, class Stays>
bool GeomTree::Tree::place(std::size_t count, SlotAt slotAt, const Geoms& geoms, int threads,
                           double most_rows, Stays stays) {
  const int most = teamFor(count, grains::slots, threads);
  clearForTeam(apart, most);
  const bool some_twice = most > 1 && !all_changed;
  if (some_twice) {
    seen.growTo(geoms.size());
    seen.clear();
  }
  return withTrees([&](auto& of) {
    using Real = RealOf<decltype(of[0])>;
    runTeam(moving, most, [&](int thread, int team) {
      const Range own = ownPart(count, thread, team);
      for (std::size_t i = own.begin; i < own.end; ++i) {
        if (i + prefetch_distance < own.end) {
          const Slot later = slotAt(i + prefetch_distance);
          if (const dxGeom* const geom = geomAt(geoms, later)) {
            prefetchBounds(geom);
            prefetchPose(geom);
          }
          of[bounded].prefetchPlace(later);
        }
        const Slot slot = slotAt(i);
        const dxGeom* const geom = geomAt(geoms, slot);
        if (some_twice && geom && !seen.insertShared(slot)) continue;
        if (!geom || !hasBoundedHits(geom) || !stays(of, slot, geom)) apart[thread].push_back(slot);
      }
    });
    for (const Buffer<Slot>& part : apart)
      for (const Slot slot : part) {
        const dxGeom* const geom = geomAt(geoms, slot);
        const Kind kind = geom && !hasBoundedHits(geom) ? other : bounded;
        of[kind].place(slot, boxOf<Real>(geom));
        of[kinds - 1 - kind].place(slot, inactiveBox<Real>());
        if (static_cast<double>(of[kind].strayRows()) > most_rows) return false;
      }
    return true;
  });
}

// False once there are more rows of strays than that: the tree is then to be built anew.
bool GeomTree::Tree::refresh(const Geoms& geoms, int threads, double most_rows) {
  const std::size_t all = std::max(geoms.size(), slots);
  const auto itself = [](std::size_t i) { return static_cast<Slot>(i); };
  // In a tree that is taken geoms of the other kind have a place in both.
  const auto isPlaced = [](auto& of, Slot slot, const dxGeom*) {
    return of[bounded].hasPlace(slot) && !of[other].hasPlace(slot);
  };
  const auto moves = [taken = is_taken](auto& of, Slot slot, const dxGeom* geom) {
    return !(taken && of[other].hasPlace(slot)) &&
           of[bounded].moveWithin(slot, boxOf<RealOf<decltype(of[0])>>(geom));
  };
  if (is_taken) narrow[bounded].numberPlaces(threads);
  // Those that the sweep left out or that are new in the tree of the other kind.
  const double most_new_rows = 1 + static_cast<double>(all) / (8 * group_size);
  const auto slotAt = [this](std::size_t i) {
    return all_changed ? static_cast<Slot>(i) : changed[i];
  };
  const bool few =
      (!is_taken || all_changed || place(all, itself, geoms, threads, most_new_rows, isPlaced)) &&
      place(all_changed ? all : changed.size(), slotAt, geoms, threads, most_rows, moves);
  if (few) setUpToDate(geoms.size());
  return few;
}

void GeomTree::takeFrom(Sweep<float>& sweep, const Geoms& geoms, std::size_t left_out) {
  if (!mechanisms::kept_query_tree || idle_frames_ == idle_frames) return;
  if (std::max(queries_, last_queries_) < 2) return;
  if (tree_.built && (!tree_.all_changed || tree_.is_wide)) return;
  if (tree_.narrow[other].cells() * group_size > geoms.size() / 2) return;  // few are of use
  // Each is a stray. With nine tenths of 10,000 left out frames took 6 times as long.
  if (left_out > geoms.size() / 64 || taking_.skipTurn() || !close()) return;
  if (!tree_.built) tree_ = Tree();
  tree_.setUpToDate(std::max(geoms.size(), tree_.slots));
  CellTrees<float>& own = tree_.narrow[bounded];
  if (own.bytes() > 2 * sweep.trees().bytes()) own = {};  // storage of a larger scene
  sweep.exchangeTrees(own);
  tree_.built = tree_.is_taken = true;
  stray_rows_ = 0;
}

bool GeomTree::clean(const Geoms& geoms) {
  if (!tree_.built || tree_.all_changed) return false;
  if (tree_.changed.size() > grains::slots.work) return false;  // for several threads
  for (const Slot slot : tree_.changed) {
    dxGeom* const geom = geomAt(geoms, slot);
    if (geom && geom->gflags & GEOM_DIRTY) cleanGeom(geom);
  }
  return true;
}

// Brings the tree up to date once that costs no more than the queries without it since a great
// change, or as there were between the two great changes before. So queries cost, in all, a small
// multiple of what they would if their number were known beforehand.
bool GeomTree::bringUpToDate(const Geoms& geoms, int threads, std::size_t queries, bool must) {
  const ScopedMode mode(exactMode());
  const double slots = static_cast<double>(geoms.size());
  if (changes_ * refresh_cost > slots) {
    last_queries_ = queries_;
    queries_ = 0;
  }
  idle_frames_ = 0;
  changes_ = 0;
  queries_ += static_cast<double>(queries);
  if (!must && (!mechanisms::query_trees || geoms.size() <= small_scene_slots)) return false;

  const double expected = std::max(queries_, last_queries_);
  const bool is_current = tree_.isCurrent();
  const bool is_cheap = stray_rows_ <= slots * build_cost;
  bool up_to_date = is_current && is_cheap;
  if (!up_to_date && tree_.built) {
    const std::size_t changed = tree_.all_changed ? geoms.size() : tree_.changed.size();
    const double cost = static_cast<double>(changed) * refresh_cost;
    if (!must && cost + (tree_.is_taken ? slots : 0) > expected * slots) return false;
    const bool most = cost > slots;  // a build may cost less
    const bool was_taken = tree_.is_taken;
    // A frame's cost is not to depend on earlier ones: strays are then an eighth of all rows.
    const double rows = must ? slots / (8 * group_size) : slots * build_cost / expected;
    const double most_rows = most ? rows : std::numeric_limits<double>::infinity();
    if (!close()) return is_current;
    const bool skipped = most && back_off_.skipTurn();
    if (!skipped && is_cheap && mechanisms::kept_query_tree) {
      up_to_date = tree_.refresh(geoms, threads, most_rows);
      if (most) up_to_date ? back_off_.paid() : back_off_.failed();
      if (was_taken) up_to_date && !most ? taking_.paid() : taking_.failed();
    }
  }
  if (!up_to_date) {
    if ((!must && build_cost > expected) || !close()) return false;
    tree_.build(geoms, threads);
    stray_rows_ = 0;
  }
  if constexpr (validates)
    if (!is_current) validate(geoms);
  if (!is_open_.load(std::memory_order_relaxed)) is_open_.store(true, std::memory_order_release);
  stray_rows_ += static_cast<double>(queries * tree_.strayRows());
  return true;
}

void GeomTree::find(const Geoms& geoms, const dxGeom* geom, Buffer<Slot>& found, Kind first) const {
  found.resizeDiscarding(geoms.size() + 2 * group_size);
  std::size_t count = 0;
  withTrees([&](const auto& of) {
    const auto box = boxOf<RealOf<decltype(of[0])>>(geom);
    for (int kind = first; kind < kinds; ++kind)
      if (!of[kind].holdsNone()) count += of[kind].find(box, found.data() + count);
  });
  // Where the boxes cannot decide, the AABBs do.
  Slot* next = found.data();
  found.resize(count);
  for (const Slot hit : found) {
    const Slot slot = hit / 2;
    *next = slot;
    next += hit % 2 == 0 || boxesOverlap(geoms[slot], geom);
  }
  found.resize(next - found.data());
}

void findHits(const GeomTree* tree, const Geoms& geoms, dxGeom* geom, const PairRules& rules,
              QueryLists& lists) {
  if (tree)
    findByTree(*tree, geoms, geom, lists);
  else
    findByTests(geoms, geom, lists.hits);
  Buffer<dxGeom*>& hits = lists.hits;
  std::size_t found = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (i + prefetch_distance < hits.size()) prefetchState(hits[i + prefetch_distance]);
    dxGeom* const own = hits[i];
    hits[found] = own;
    found += rules.isHit(own, geom);
  }
  hits.resize(found);
}

}  // namespace ode_parallel_sap
