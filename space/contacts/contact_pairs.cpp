#include "space/contacts/contact_pairs.h"

#include <new>

#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

static Region resolving("pairs: geoms");

void ContactPairs::addSpace(dGeomID o1, dGeomID o2) {
  struct Depth {
    int& depth;
    ~Depth() { --depth; }
  } const within = {++depth_};
  if (request_.callbacks.spaces)
    request_.callbacks.spaces(request_.data, o1, o2, this);
  else
    dSpaceCollide2(o1, o2, this, &dParallelSAPAddPair);
}

void ContactPairs::add(dGeomID o1, dGeomID o2) {
  if (failure_) return;
  if (depth_ == 0) {
    top_ = makePair(Slots::slotOf(o1), Slots::slotOf(o2));
    if (firsts_) try {
        firsts_->push_back(list_.size());
      } catch (const std::bad_alloc&) {
        is_complete_ = false;
      }
  }
  if (IS_SPACE(o1) || IS_SPACE(o2)) {
    addSpace(o1, o2);
    if (failure_ && depth_ == 0) std::rethrow_exception(failure_);
    return;
  }
  // Other threads may then read the geoms, and colliders of meshes read bounds, too.
  for (const dGeomID geom : {o1, o2}) {
    geom->recomputePosr();
    geom->recomputeAABB();
  }
  const dParallelSAPPair pair = {o1, o2};
  const Pair slots = makePair(slotOf(o1), slotOf(o2));
  try {
    slots_.push_back(slots);
    return list_.push_back(pair);
  } catch (const std::bad_alloc&) {
    is_complete_ = false;
  }
  try {
    NarrowPhase::collideOneByOne(*this, request_);
    list_.release();
    slots_.release();
    if (stays(pair, slots)) NarrowPhase::collideOne(pair, request_, scene_);
  } catch (...) {
    if (depth_ == 0) throw;
    failure_ = std::current_exception();
  }
}

void ContactPairs::add(const PairList& pairs, bool spaces, int threads) {
  const Buffer<dxGeom*>& geoms = scene_.slots;
  try {
    if (!spaces) {
      list_.resizeDiscarding(pairs.size());
      resolve(pairs, {0, pairs.size()}, geoms.data(), threads, list_.data());
      cursor_.emplace(pairs);
      return;
    }
  } catch (const std::bad_alloc&) {
    list_.resizeDiscarding(0);
  }
  for (const PairList::Run& run : pairs.runs)
    for (const Pair pair : run) {
      dxGeom *const a = geoms[earlierOf(pair)], *const b = geoms[laterOf(pair)];
      if (a && b) add(a, b);
    }
}

// Of the two slots whose pair is added.
Slot ContactPairs::slotOf(const dxGeom* geom) const {
  const dxGeom* const later = scene_.slots[laterOf(top_)];
  while (geom && geom != later) geom = geom->parent_space;
  return geom ? laterOf(top_) : earlierOf(top_);
}

bool ContactPairs::stays(std::size_t place) {
  if (!scene_.reports.changed()) return true;
  Pair slots = 0;
  if (cursor_)
    cursor_->read(place, place + 1, [&](const Pair* pair, const Pair*) { slots = *pair; });
  else
    slots = slots_[place];
  return stays(list_[place], slots);
}

bool ContactPairs::stays(const dParallelSAPPair& pair, Pair slots) const {
  const Reports& reports = scene_.reports;
  return !reports.changed() || (reports.holds(scene_.slots, earlierOf(slots), pair.o1) &&
                                reports.holds(scene_.slots, laterOf(slots), pair.o2));
}

// Prefetches from the table of geoms: the entry of the later geom may be anywhere in it.
dParallelSAPPair* resolve(const Pair* begin, const Pair* end, dxGeom* const* geoms,
                          dParallelSAPPair* to) {
  constexpr std::ptrdiff_t ahead = prefetch_distance;
  for (const Pair* pair = begin; pair < end; ++pair) {
    if (end - pair > ahead) prefetch(&geoms[laterOf(pair[ahead])]);
    *to++ = {geoms[earlierOf(*pair)], geoms[laterOf(*pair)]};
  }
  return to;
}

void resolve(const PairList& pairs, Range places, dxGeom* const* geoms, int threads,
             dParallelSAPPair* to) {
  const std::size_t count = places.end - places.begin;
  runTeam(resolving, teamFor(count, grains::moved_pairs, threads), [&](int thread, int team) {
    const Range own = ownPart(count, thread, team);
    dParallelSAPPair* next = to + own.begin;
    PairCursor(pairs).read(
        places.begin + own.begin, places.begin + own.end,
        [&](const Pair* begin, const Pair* end) { next = resolve(begin, end, geoms, next); });
  });
}

}  // namespace ode_parallel_sap
