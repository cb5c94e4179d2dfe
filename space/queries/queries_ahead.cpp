#include "space/queries/queries_ahead.h"

#include <algorithm>
#include <cstring>

#include "space/data/floating_point.h"
#include "space/data/mechanisms.h"
#include "space/data/parallel.h"
#include "space/geom/geom_prefetch.h"
#include "space/geom/geom_tests.h"

namespace ode_parallel_sap {

namespace {

Region searching("queries ahead: searches");

// fixed: 8 MB. A thread that has found so much stops.
constexpr std::size_t most_found = std::size_t{1} << 20;

// Whether its AABB can be known before it is asked for.
bool isForeseen(const dxGeom* geom) {
  return !IS_SPACE(geom) && (!(geom->gflags & GEOM_AABB_BAD) || !needsCallingThread(geom));
}

// fixed: queries between the prefetch of what one will look at and itself: a query takes longer
// than memory does, a few of them in any case.
constexpr std::size_t answers_ahead = 4;

}  // namespace

bool QueriesAhead::holds(const dxGeom* geom) const {
  return next_ < items_.size() && items_[next_].geom == geom &&
         std::memcmp(items_[next_].bounds, geom->aabb, sizeof geom->aabb) == 0;
}

void QueriesAhead::giveUp() {
  items_.resizeDiscarding(0);
  next_ = 0;
  run_ = 0;
  most_ = least_run;
  back_off_.failed();
}

// Comes to the next item that will be asked for, or to the end.
void QueriesAhead::skipOthers() {
  while (next_ < items_.size() && !items_[next_].comes) ++next_;
  if (next_ < items_.size()) return;
  items_.resizeDiscarding(0);
  next_ = 0;
  most_ = std::min(4 * most_, most_ahead);
  back_off_.paid();
}

bool QueriesAhead::isDue(const dxGeom* geom) {
  run_ = geom == expected_ ? run_ + 1 : 1;
  expected_ = geom->next;
  if (!mechanisms::queries_ahead) return false;
  if (holds(geom)) return false;
  if (next_ < items_.size() && items_[next_].geom == geom) giveUp();  // it has moved since
  if (back_off_.waits()) {
    back_off_.pass();
    return false;
  }
  if (run_ < least_run) return false;
  drop();  // another list
  return !back_off_.waits();
}

bool QueriesAhead::take(const dxGeom* geom, Answer& answer) {
  if (!holds(geom)) return false;
  const Item& item = items_[next_];
  const bool known = item.known;
  if (known) {
    dxGeom* const* const found = shares_[item.share].geoms.data();
    answer = {found + item.begin, found + item.end};
  }
  run_ = std::max(run_, least_run);
  prefetch(next_ + answers_ahead);
  ++next_;
  skipOthers();
  return known;
}

// What the item's answer and its query will look at first.
void QueriesAhead::prefetch(std::size_t index) const {
  if (index + prefetch_distance < items_.size())
    prefetchBounds(items_[index + prefetch_distance].geom);
  if (index >= items_.size() || !items_[index].known) return;
  const Item& item = items_[index];
  const std::size_t end = std::min(item.end, item.begin + prefetch_distance);
  for (std::size_t i = item.begin; i < end; ++i) prefetchState(shares_[item.share].geoms[i]);
}

QueriesAhead::Found QueriesAhead::find(const Geoms& geoms, const GeomTree& tree, dxGeom* geom,
                                       int threads) {
  gather(geom);
  const std::size_t count = items_.size();
  if (count == 0) return {};
  const int team = teamFor(count, grains::searches, threads);
  if (shares_.size() < static_cast<std::size_t>(team)) shares_.resize(team);
  for (Share& share : shares_) share.geoms.resizeDiscarding(0);
  const int used =
      runChunks(searching, team, count, chunkOf(count, grains::searches.work / 2, team),
                [&](const Range& range, int thread) {
                  findSome(geoms, tree, range, static_cast<std::uint32_t>(thread));
                });
  std::size_t found = 0;
  for (const Share& share : shares_) found += share.geoms.size();
  mean_found_ = static_cast<double>(found) / static_cast<double>(count);
  next_ = 0;
  skipOthers();
  return {count, used};
}

void QueriesAhead::gather(dxGeom* geom) {
  const double most = static_cast<double>(most_found) / (mean_found_ + 1);
  const std::size_t count = std::min(most_, static_cast<std::size_t>(most) + 1);
  items_.resizeDiscarding(0);
  items_.reserve(count);
  for (; geom && items_.size() < count && isForeseen(geom); geom = geom->next) {
    Item item = {};
    item.geom = geom;
    items_.push_back(item);
  }
}

// Searches of the thread with this number. AABBs are made in the program's mode, as ODE's own.
void QueriesAhead::findSome(const Geoms& geoms, const GeomTree& tree, const Range& range,
                            std::uint32_t number) {
  for (std::size_t i = range.begin; i < range.end; ++i) prefetchBounds(items_[i].geom);
  for (std::size_t i = range.begin; i < range.end; ++i) updateAABB(items_[i].geom);
  const ScopedMode mode(exactMode());
  Share& share = shares_[number];
  for (std::size_t i = range.begin; i < range.end; ++i) {
    Item& item = items_[i];
    std::memcpy(item.bounds, item.geom->aabb, sizeof item.bounds);
    item.comes = !hasNaN(item.geom);
    item.known = item.comes && share.geoms.size() < most_found;
    if (!item.known) continue;
    tree.find(geoms, item.geom, share.slots.list());
    item.share = number;
    item.begin = share.geoms.size();
    item.end = item.begin + share.slots.list().size();
    share.geoms.resize(item.end);
    dxGeom** next = share.geoms.data() + item.begin;
    share.slots.forEachInOrder(geoms.size(), [&](Slot slot) { *next++ = geoms[slot]; });
  }
}

void QueriesAhead::release() {
  *this = QueriesAhead();
}

}  // namespace ode_parallel_sap
