#include "space/queries/geom_queries.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "space/data/slot_set.h"
#include "space/data/tuning.h"
#include "space/geom/geom_tests.h"
#include "space/geom/plane_test.h"
#include "space/geom/prefetch.h"
#include "space/queries/tuning.h"

namespace ode_parallel_sap {

namespace {

constexpr std::size_t word_slots = SlotSet::word_slots;

void prefetch(const dxGeom* geom) {
  prefetchState(geom);
  prefetchBounds(geom);
}

void growZeroed(Buffer<std::uint64_t>& words, std::size_t size) {
  const std::size_t before = words.size();
  if (size <= before) return;
  words.resize(size);
  std::fill(words.begin() + before, words.end(), 0);
}

// Whether geoms pair whose AABBs overlap. Needs exactMode().
bool pairs(const dxGeom* own, const dxGeom* geom) {
  return isEnabled(own) && filtersMatch(own, geom);
}

}  // namespace

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
  ahead_.release();
  hits_.release();
  found_.release();
  marks_.release();
  marked_words_.release();
}

void GeomQueries::find(const Geoms& geoms, dxGeom* geom, const Way& way, Buffer<dxGeom*>& hits) {
  bool has_tree;
  {
    const ScopedMode mode(exactMode());
    has_tree = tree_.bringUpToDate(geoms, way.threads);
  }
  looked_ahead_.queries = 0;
  if (has_tree && way.ahead && way.foreseen && ahead_.isDue(geom))
    lookAhead(geoms, geom, way.ahead);
  const ScopedMode mode(exactMode());
  QueriesAhead::Answer known;
  if (has_tree && ahead_.take(geom, known)) {
    hits.resizeDiscarding(known.end - known.begin);
    std::copy(known.begin, known.end, hits.data());
  } else if (has_tree) {
    findByTree(geoms, geom, hits);
  } else {
    findByTests(geoms, geom, hits);
  }
  std::size_t found = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (i + prefetch_distance < hits.size()) prefetchState(hits[i + prefetch_distance]);
    dxGeom* const own = hits[i];
    hits[found] = own;
    found += pairs(own, geom) && !(way.cull_planes && areClearByPlane(own, geom));
  }
  hits.resize(found);
}

void GeomQueries::lookAhead(const Geoms& geoms, dxGeom* geom, int threads) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  const QueriesAhead::Found found = ahead_.find(geoms, tree_, geom, threads);
  looked_ahead_.queries = found.queries;
  looked_ahead_.threads = found.threads;
  looked_ahead_.ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void GeomQueries::findByTree(const Geoms& geoms, const dxGeom* geom, Buffer<dxGeom*>& hits) {
  tree_.find(geoms, geom, found_);
  hits.resizeDiscarding(found_.size());
  dxGeom** next = hits.data();
  forFoundInOrder(geoms.size(), [&](Slot slot) {
    dxGeom* const own = geoms[slot];
    prefetchState(own);
    *next++ = own;
  });
}

void GeomQueries::findByTests(const Geoms& geoms, const dxGeom* geom, Buffer<dxGeom*>& hits) {
  hits.resizeDiscarding(0);
  for (std::size_t slot = 0; slot < geoms.size(); ++slot) {
    if (slot + prefetch_distance < geoms.size())
      if (const dxGeom* const later = geoms[slot + prefetch_distance]) prefetch(later);
    dxGeom* const own = geoms[slot];
    if (own && boxesOverlap(own, geom)) hits.push_back(own);
  }
}

}  // namespace ode_parallel_sap
