#include "space/queries/geom_tree.h"

#include <algorithm>
#include <limits>
#include <type_traits>

#include "space/base/mechanisms.h"
#include "space/base/round_to_floats.h"
#include "space/base/tuning.h"
#include "space/geoms/geom_prefetch.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

// Up to this number dirty geoms are cleaned by one thread on the way.
constexpr std::size_t most_cleaned_alone = grains::packed_slots.work;

dxGeom* geomAt(const Buffer<dxGeom*>& geoms, std::size_t slot) {
  return slot < geoms.size() ? geoms[slot] : nullptr;
}

void prefetchAhead(const Buffer<dxGeom*>& geoms, std::size_t slot) {
  if (const dxGeom* const geom = geomAt(geoms, slot + prefetch_distance)) prefetchBounds(geom);
}

template <class Tree>
using RealOf = typename std::remove_reference<Tree>::type::RealType;

// Of what a tree holds.
template <class Real>
BasicBox<Real> boxIn(const dxGeom* geom, GeomTree::Takes takes, bool& coarse) {
  return boxOf<Real>(geom && takes && !takes(geom) ? nullptr : geom, coarse);
}

}  // namespace

template <class Real>
BasicBox<Real> boxOf(const dxGeom* geom, bool& coarse) {
  constexpr BasicBox<Real> none = inactiveBox<Real>();
  if (!geom) return none;
  if constexpr (sizeof(Real) == sizeof(float)) {
    Box box;
    const BoundsFacts facts = roundToFloats(geom->aabb, box);
    coarse = facts & coarse_bounds;
    return facts & nan_bounds ? none : box;
  } else {
    return hasNaN(geom) ? none : boxOfBounds<Real>(geom->aabb);
  }
}

template BasicBox<float> boxOf<float>(const dxGeom* geom, bool& coarse);
template BasicBox<double> boxOf<double>(const dxGeom* geom, bool& coarse);

// Returns how many boxes floats make clearly larger.
template <class Real>
std::size_t GeomTree::Tree::pack(const Geoms& geoms, Takes takes, Buffer<BasicBox<Real>>& into) {
  std::size_t count = 0;
  into.resizeDiscarding(geoms.size());
  for (std::size_t slot = 0; slot < geoms.size(); ++slot) {
    prefetchAhead(geoms, slot);
    bool coarse = false;
    into[slot] = boxIn<Real>(geoms[slot], takes, coarse);
    count += coarse;
  }
  return count;
}

void GeomTree::Tree::build(const Geoms& geoms, Takes takes, int threads) {
  built = false;
  boxes.size = geoms.size();
  const std::size_t coarse = pack(geoms, takes, boxes.boxes);
  // A small part of them will do as floats.
  is_wide = sizeof(dReal) > sizeof(float) && coarse > geoms.size() / 8;
  if (is_wide) pack(geoms, takes, boxes.wide_boxes);
  boxes.wide = is_wide;
  (is_wide ? boxes.boxes.release() : boxes.wide_boxes.release());
  if (is_wide)
    narrow = {};
  else
    wide = {};
  withTree([&](auto& tree) { tree.build(boxes, threads); });
  // Of use again where building comes again.
  if (++builds == 1) {
    withTree([](auto& tree) { tree.releaseScratch(); });
    boxes = BoxSet();
  }
  setUpToDate(geoms.size());
  built = true;
}

void GeomTree::Tree::setUpToDate(std::size_t slots_now) {
  slots = slots_now;
  changed.resizeDiscarding(0);
  changed.reserve(static_cast<std::size_t>(static_cast<double>(slots) / refresh_cost) + 1);
  all_changed = false;
}

// False once there are more rows of strays than that: the tree is then to be built anew.
bool GeomTree::Tree::refresh(const Geoms& geoms, Takes takes, double most_rows) {
  const std::size_t places = all_changed ? std::max(geoms.size(), slots) : changed.size();
  const bool few = withTree([&](auto& tree) {
    for (std::size_t i = 0; i < places; ++i) {
      const std::size_t slot = all_changed ? i : changed[i];
      if (all_changed) prefetchAhead(geoms, slot);
      bool coarse;
      tree.place(static_cast<Slot>(slot),
                 boxIn<RealOf<decltype(tree)>>(geomAt(geoms, slot), takes, coarse));
      if (static_cast<double>(tree.strayRows()) > most_rows) return false;
    }
    return true;
  });
  if (few) setUpToDate(geoms.size());
  return few;
}

bool GeomTree::clean(const Geoms& geoms) {
  if (!tree_ || !tree_->built || tree_->all_changed) return false;
  if (tree_->changed.size() > most_cleaned_alone) return false;
  for (const Slot slot : tree_->changed) {
    dxGeom* const geom = geomAt(geoms, slot);
    if (geom && geom->gflags & GEOM_DIRTY) cleanGeom(geom);
  }
  return true;
}

// Brings the tree up to date once that costs no more than the queries without it since a great
// change, or as there were between the two great changes before. So queries cost, in all, a small
// multiple of what they would if their number were known beforehand.
bool GeomTree::bringUpToDate(const Geoms& geoms, int threads, double queries) {
  const double slots = static_cast<double>(geoms.size());
  if (changes_ * refresh_cost > slots) {
    last_queries_ = queries_;
    queries_ = 0;
  }
  asked_ = true;
  idle_frames_ = 0;
  changes_ = 0;
  queries_ += queries;
  if (!mechanisms::query_trees || geoms.size() <= small_scene_slots) return false;

  const double expected = std::max(queries_, last_queries_);
  const bool is_current = tree_ && tree_->isCurrent();
  const bool is_cheap = stray_rows_ <= slots * build_cost;
  bool up_to_date = is_current && is_cheap;
  if (!up_to_date && tree_ && tree_->built) {
    const std::size_t changed = tree_->all_changed ? geoms.size() : tree_->changed.size();
    const double cost = static_cast<double>(changed) * refresh_cost;
    if (cost > expected * slots) return false;
    const double most_rows =
        cost > slots ? slots * build_cost / expected : std::numeric_limits<double>::infinity();
    if (!close()) return is_current;
    up_to_date =
        is_cheap && mechanisms::kept_query_tree && tree_->refresh(geoms, takes_, most_rows);
  }
  if (!up_to_date) {
    if (build_cost > expected || !close()) return false;
    if (!tree_) tree_ = std::make_unique<Tree>();
    tree_->build(geoms, takes_, threads);
    stray_rows_ = 0;
  }
  if (!is_open_.load(std::memory_order_relaxed)) is_open_.store(true, std::memory_order_release);
  stray_rows_ += queries * static_cast<double>(
                               tree_->withTree([](const auto& tree) { return tree.strayRows(); }));
  return true;
}

void GeomTree::find(const Geoms& geoms, const dxGeom* geom, Buffer<Slot>& found) const {
  withTree([&](const auto& tree) {
    found.resizeDiscarding(geoms.size() + tree.spare);
    bool coarse;
    found.resize(tree.find(boxOf<RealOf<decltype(tree)>>(geom, coarse), found.data()));
  });
  // Where the boxes cannot decide, the AABBs do.
  Slot* next = found.data();
  for (Slot slot : found) {
    if (slot & borderline_slot) {
      slot &= ~borderline_slot;
      if (!boxesOverlap(geoms[slot], geom)) continue;
    }
    *next++ = slot;
  }
  found.resize(next - found.data());
}

}  // namespace ode_parallel_sap
