#include "space/queries/geom_queries.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "space/data/mechanisms.h"
#include "space/data/round_outward.h"
#include "space/data/slot_set.h"
#include "space/data/tuning.h"
#include "space/geom/geom_tests.h"
#include "space/geom/plane_test.h"
#include "space/queries/query_tree.h"
#include "space/queries/tuning.h"

namespace ode_parallel_sap {

namespace {

// Up to this number dirty geoms are cleaned by one thread on the way.
constexpr std::size_t most_cleaned_alone = grains::packed_slots.work;
constexpr std::size_t word_slots = SlotSet::word_slots;

dxGeom* geomAt(const Buffer<dxGeom*>& geoms, std::size_t slot) {
  return slot < geoms.size() ? geoms[slot] : nullptr;
}

template <class Real>
BasicBox<Real> boxOf(const dxGeom* geom, bool& coarse) {
  constexpr Real nan = std::numeric_limits<Real>::quiet_NaN();
  constexpr BasicBox<Real> none = {{nan, nan, nan}, {nan, nan, nan}};
  if (!geom) return none;
  if constexpr (sizeof(Real) == sizeof(float)) {
    Box box;
    const BoundsFacts facts = roundOutward(geom->aabb, box);
    coarse = facts.coarse;
    return facts.nan ? none : box;
  } else {
    if (hasNaN(geom)) return none;
    BasicBox<Real> box;
    for (int axis = 0; axis < 3; ++axis) {
      box.lower[axis] = geom->aabb[2 * axis];
      box.upper[axis] = geom->aabb[2 * axis + 1];
    }
    return box;
  }
}

// What pairs() reads.
void prefetch(const dxGeom* geom) {
  __builtin_prefetch(&geom->gflags);
  __builtin_prefetch(geom->aabb);
  __builtin_prefetch(&geom->collide_bits);
}

void prefetchAhead(const Buffer<dxGeom*>& geoms, std::size_t slot) {
  const dxGeom* const geom = geomAt(geoms, slot + prefetch_distance);
  if (geom) prefetch(geom);
}

void growZeroed(Buffer<std::uint64_t>& words, std::size_t size) {
  const std::size_t before = words.size();
  if (size <= before) return;
  words.resize(size);
  std::fill(words.begin() + before, words.end(), 0);
}

template <class Tree>
using RealOf = typename std::remove_reference<Tree>::type::RealType;

// Whether geoms pair whose AABBs overlap. Needs exactMode().
bool pairs(const dxGeom* own, const dxGeom* geom) {
  return isEnabled(own) && filtersMatch(own, geom);
}

}  // namespace

struct GeomQueries::Tree {
  bool built = false;
  bool is_wide = false;  // boxes of doubles; of floats where these are fine enough
  bool all_changed = false;
  Buffer<Slot> changed;   // since the tree was up to date, unless all_changed; some twice
  std::size_t slots = 0;  // when the tree was up to date
  unsigned builds = 0;
  BoxSet boxes;  // of the last build
  QueryTree<float> narrow;
  QueryTree<double> wide;
  Buffer<Slot> found;
  // A bit a slot, and a bit for each word of those; all 0 between queries.
  Buffer<std::uint64_t> marks, marked_words;

  template <class Work>
  auto withTree(Work work) {
    return is_wide ? work(wide) : work(narrow);
  }
  template <class Real>
  std::size_t pack(const Geoms& geoms, Buffer<BasicBox<Real>>& into);
  void build(const Geoms& geoms, int threads);
  void refresh(const Geoms& geoms);
  double strayingPart(const Geoms& geoms);
  void search(const Geoms& geoms, const dxGeom* geom);
  void decideUnsure(const Geoms& geoms, const dxGeom* geom);
  template <class Visit>
  void forFoundInOrder(std::size_t slots, Visit visit);
  void setUpToDate(std::size_t slots);
};

// Returns how many boxes floats make clearly larger.
template <class Real>
std::size_t GeomQueries::Tree::pack(const Geoms& geoms, Buffer<BasicBox<Real>>& into) {
  std::size_t count = 0;
  into.resizeDiscarding(geoms.size());
  for (std::size_t slot = 0; slot < geoms.size(); ++slot) {
    prefetchAhead(geoms, slot);
    bool coarse = false;
    into[slot] = boxOf<Real>(geoms[slot], coarse);
    count += coarse;
  }
  return count;
}

void GeomQueries::Tree::build(const Geoms& geoms, int threads) {
  built = false;
  boxes.size = geoms.size();
  const std::size_t coarse = pack(geoms, boxes.boxes);
  // A small part of them will do as floats.
  is_wide = sizeof(dReal) > sizeof(float) && coarse > geoms.size() / 8;
  if (is_wide) pack(geoms, boxes.wide_boxes);
  boxes.wide = is_wide;
  (is_wide ? boxes.boxes.release() : boxes.wide_boxes.release());
  if (is_wide)
    narrow.release();
  else
    wide.release();
  withTree([&](auto& tree) { tree.build(boxes, threads); });
  // Of use again where building comes again.
  if (++builds == 1) {
    withTree([](auto& tree) { tree.releaseScratch(); });
    boxes = BoxSet();
  }
  setUpToDate(geoms.size());
  built = true;
}

void GeomQueries::Tree::setUpToDate(std::size_t slots_now) {
  slots = slots_now;
  changed.resizeDiscarding(0);
  changed.reserve(static_cast<std::size_t>(static_cast<double>(slots) / refresh_cost) + 1);
  all_changed = false;
}

void GeomQueries::Tree::refresh(const Geoms& geoms) {
  withTree([&](auto& tree) {
    const auto place = [&](std::size_t slot) {
      bool coarse;
      tree.place(static_cast<Slot>(slot),
                 boxOf<RealOf<decltype(tree)>>(geomAt(geoms, slot), coarse));
    };
    if (all_changed)
      for (std::size_t slot = 0; slot < std::max(geoms.size(), slots); ++slot) {
        prefetchAhead(geoms, slot);
        place(slot);
      }
    else
      for (const Slot slot : changed) place(slot);
  });
  setUpToDate(geoms.size());
}

// Of all geoms, by a sample: the part that will not fit where the tree has it.
double GeomQueries::Tree::strayingPart(const Geoms& geoms) {
  constexpr std::size_t most_samples = 64;  // fixed: within some percent
  const std::size_t samples = std::min(most_samples, geoms.size());
  std::size_t strays = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const std::size_t slot = geoms.size() / samples * i;
    strays += withTree([&](auto& tree) {
      bool coarse;
      return !tree.fits(static_cast<Slot>(slot),
                        boxOf<RealOf<decltype(tree)>>(geoms[slot], coarse));
    });
  }
  return static_cast<double>(strays) / static_cast<double>(samples);
}

void GeomQueries::Tree::search(const Geoms& geoms, const dxGeom* geom) {
  withTree([&](auto& tree) {
    found.resizeDiscarding(geoms.size() + tree.spare);
    bool coarse;
    found.resize(tree.find(boxOf<RealOf<decltype(tree)>>(geom, coarse), found.data()));
  });
  decideUnsure(geoms, geom);
}

// Where the boxes cannot decide, the AABBs do.
void GeomQueries::Tree::decideUnsure(const Geoms& geoms, const dxGeom* geom) {
  Slot* next = found.data();
  for (Slot slot : found) {
    if (slot & unsure_slot) {
      slot &= ~unsure_slot;
      if (!boxesOverlap(geoms[slot], geom)) continue;
    }
    *next++ = slot;
  }
  found.resize(next - found.data());
}

// Calls visit(slot) for what was found, ascending. Few slots are sorted, many ticked off.
template <class Visit>
void GeomQueries::Tree::forFoundInOrder(std::size_t slots_now, Visit visit) {
  if (found.size() < slots_now / many_hits + 16) {
    std::sort(found.begin(), found.end());
    for (const Slot slot : found) visit(slot);
    return;
  }
  const std::size_t words = slots_now / word_slots + 1;
  growZeroed(marks, words);
  growZeroed(marked_words, words / word_slots + 1);
  for (const Slot slot : found) {
    const std::size_t word = slot / word_slots;
    marks[word] |= std::uint64_t{1} << slot % word_slots;
    marked_words[word / word_slots] |= std::uint64_t{1} << word % word_slots;
  }
  for (std::size_t first = 0; first < words; first += word_slots)
    for (std::uint64_t& rest = marked_words[first / word_slots]; rest; rest &= rest - 1) {
      const std::size_t word = first + __builtin_ctzll(rest);
      for (std::uint64_t bits = std::exchange(marks[word], 0); bits; bits &= bits - 1)
        visit(static_cast<Slot>(word * word_slots + __builtin_ctzll(bits)));
    }
}

GeomQueries::GeomQueries() = default;
GeomQueries::~GeomQueries() = default;

void GeomQueries::note(std::size_t slot) {
  if (tree_->all_changed) return;
  if (tree_->changed.size() < tree_->changed.capacity())
    tree_->changed.push_back(static_cast<Slot>(slot));
  else
    tree_->all_changed = true;
}

void GeomQueries::reset() {
  if (tree_) tree_->built = false;
}

void GeomQueries::release() {
  tree_.reset();
  hits_.release();
}

bool GeomQueries::clean(const Geoms& geoms) {
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
bool GeomQueries::bringUpToDate(const Geoms& geoms, int threads) {
  const double slots = static_cast<double>(geoms.size());
  if (changes_ * refresh_cost > slots) {
    last_queries_ = queries_;
    queries_ = 0;
  }
  changes_ = 0;
  queries_ += 1;
  if (!mechanisms::query_trees || geoms.size() <= smallest_scene) return false;

  const double expected = std::max(queries_, last_queries_);
  bool build = !tree_ || !tree_->built;
  if (!build) {
    const std::size_t changed = tree_->all_changed ? geoms.size() : tree_->changed.size();
    const double cost = static_cast<double>(changed) * refresh_cost;
    if (cost > expected * slots) return false;
    const double straying = cost > slots ? tree_->strayingPart(geoms) : 0;
    const double rows = straying * slots / group_size;
    build = rows * expected > slots * build_cost || stray_rows_ > slots * build_cost ||
            (!mechanisms::kept_query_tree && changed > 0);
    if (!build && changed) tree_->refresh(geoms);
  }
  if (build) {
    if (slots * build_cost > expected * slots) return false;
    if (!tree_) tree_ = std::make_unique<Tree>();
    tree_->build(geoms, threads);
    stray_rows_ = 0;
  }
  stray_rows_ +=
      static_cast<double>(tree_->withTree([](const auto& tree) { return tree.strayRows(); }));
  return true;
}

void GeomQueries::find(const Geoms& geoms, dxGeom* geom, bool cull_planes, int threads,
                       Buffer<dxGeom*>& hits) {
  const ScopedMode mode(exactMode());
  asked_ = true;
  idle_frames_ = 0;
  if (bringUpToDate(geoms, threads)) {
    tree_->search(geoms, geom);
    hits.resizeDiscarding(tree_->found.size());
    dxGeom** next = hits.data();
    tree_->forFoundInOrder(geoms.size(), [&](Slot slot) {
      dxGeom* const own = geoms[slot];
      __builtin_prefetch(&own->gflags);
      __builtin_prefetch(&own->collide_bits);
      *next++ = own;
    });
    next = hits.data();
    for (dxGeom* const own : hits) {
      *next = own;
      next += pairs(own, geom) && !(cull_planes && areClearByPlane(own, geom));
    }
    hits.resize(next - hits.data());
    return;
  }
  hits.resizeDiscarding(0);
  for (std::size_t slot = 0; slot < geoms.size(); ++slot) {
    prefetchAhead(geoms, slot);
    dxGeom* const own = geoms[slot];
    if (own && boxesOverlap(own, geom) && pairs(own, geom) &&
        !(cull_planes && areClearByPlane(own, geom)))
      hits.push_back(own);
  }
}

std::size_t GeomQueries::bytes() const {
  if (!tree_) return hits_.bytes();
  return hits_.bytes() + sizeof *tree_ + tree_->changed.bytes() + tree_->boxes.bytes() +
         tree_->narrow.bytes() + tree_->wide.bytes() + tree_->found.bytes() + tree_->marks.bytes() +
         tree_->marked_words.bytes();
}

}  // namespace ode_parallel_sap
