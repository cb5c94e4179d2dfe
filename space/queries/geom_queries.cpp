#include "space/queries/geom_queries.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "space/data/slot_set.h"
#include "space/data/tuning.h"
#include "space/geom/geom_tests.h"
#include "space/geom/plane_test.h"
#include "space/queries/tuning.h"

namespace ode_parallel_sap {

namespace {

constexpr std::size_t word_slots = SlotSet::word_slots;

// What pairs() reads.
void prefetch(const dxGeom* geom) {
  __builtin_prefetch(&geom->gflags);
  __builtin_prefetch(geom->aabb);
  __builtin_prefetch(&geom->collide_bits);
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

void GeomQueries::search(const Geoms& geoms, const dxGeom* geom) {
  tree_.withTree([&](const auto& tree) {
    found_.resizeDiscarding(geoms.size() + tree.spare);
    bool coarse;
    found_.resize(tree.find(boxOf<RealOf<decltype(tree)>>(geom, coarse), found_.data()));
  });
  decideBorderline(geoms, geom);
}

// Where the boxes cannot decide, the AABBs do.
void GeomQueries::decideBorderline(const Geoms& geoms, const dxGeom* geom) {
  Slot* next = found_.data();
  for (Slot slot : found_) {
    if (slot & borderline_slot) {
      slot &= ~borderline_slot;
      if (!boxesOverlap(geoms[slot], geom)) continue;
    }
    *next++ = slot;
  }
  found_.resize(next - found_.data());
}

// Calls visit(slot) for what was found, ascending. Few slots are sorted, many ticked off.
template <class Visit>
void GeomQueries::forFoundInOrder(std::size_t slots_now, Visit visit) {
  if (found_.size() < slots_now / many_hits + 16) {
    std::sort(found_.begin(), found_.end());
    for (const Slot slot : found_) visit(slot);
    return;
  }
  const std::size_t words = slots_now / word_slots + 1;
  growZeroed(marks_, words);
  growZeroed(marked_words_, words / word_slots + 1);
  for (const Slot slot : found_) {
    const std::size_t word = slot / word_slots;
    marks_[word] |= std::uint64_t{1} << slot % word_slots;
    marked_words_[word / word_slots] |= std::uint64_t{1} << word % word_slots;
  }
  for (std::size_t first = 0; first < words; first += word_slots)
    for (std::uint64_t& rest = marked_words_[first / word_slots]; rest; rest &= rest - 1) {
      const std::size_t word = first + __builtin_ctzll(rest);
      for (std::uint64_t bits = std::exchange(marks_[word], 0); bits; bits &= bits - 1)
        visit(static_cast<Slot>(word * word_slots + __builtin_ctzll(bits)));
    }
}

void GeomQueries::release() {
  tree_.release();
  hits_.release();
  found_.release();
  marks_.release();
  marked_words_.release();
}

void GeomQueries::find(const Geoms& geoms, dxGeom* geom, bool cull_planes, int threads,
                       Buffer<dxGeom*>& hits) {
  const ScopedMode mode(exactMode());
  if (tree_.bringUpToDate(geoms, threads)) {
    search(geoms, geom);
    hits.resizeDiscarding(found_.size());
    dxGeom** next = hits.data();
    forFoundInOrder(geoms.size(), [&](Slot slot) {
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
    if (slot + prefetch_distance < geoms.size())
      if (const dxGeom* const later = geoms[slot + prefetch_distance]) prefetch(later);
    dxGeom* const own = geoms[slot];
    if (own && boxesOverlap(own, geom) && pairs(own, geom) &&
        !(cull_planes && areClearByPlane(own, geom)))
      hits.push_back(own);
  }
}

}  // namespace ode_parallel_sap
