#include "space/ode/ode_space.h"

#include <algorithm>
#include <new>
#include <utility>

#include "space/frame/space_scopes.h"
#include "space/geom/geom_tests.h"
#include "space/geom/plane_test.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

constexpr std::size_t most_slots = std::size_t{1} << 28;

std::size_t slotIn(const dxGeom* geom) {
  return reinterpret_cast<std::size_t>(geom->tome_ex) - 1;
}
void setSlot(dxGeom* geom, std::size_t slot) {
  geom->tome_ex = reinterpret_cast<dxGeom**>(slot + 1);
}
void clearSlot(dxGeom* geom) {
  geom->tome_ex = nullptr;
}

}  // namespace

ParallelSAPSpace::ParallelSAPSpace(dSpaceID parent, int space_class)
    : dxSpace(parent), settings(settingsFromEnvironment()) {
  type = space_class;
  timed_ = settings.print_stats;
}

ParallelSAPSpace::~ParallelSAPSpace() {
  CHECK_NOT_LOCKED(this);
  if (settings.print_stats && prints_totals_) printTotals();
  // The base class's destructor would not reach remove() any more.
  while (first) {
    if (cleanup)
      dGeomDestroy(first);
    else
      remove(first);
  }
}

void ParallelSAPSpace::printTotals() const {
  const FrameSums::Sums frame = totals_.average();
  if (!frame.frames) return;
  dMessage(
      0,
      "parallel SAP space %p: %llu frames (%s), a frame: %.0f geoms, %.0f pairs, %.0f contacts, "
      "%.3f ms (update %.3f, synchronise %.3f, extract %.3f, filter %.3f, narrow %.3f, report "
      "%.3f)",
      static_cast<const void*>(this), frame.frames, kernelSet().name, frame.geoms, frame.pairs,
      frame.contacts, frame.total_ms, frame.update_ms, frame.synchronise_ms, frame.extract_ms,
      frame.filter_ms, frame.narrow_ms, frame.report_ms);
}

void ParallelSAPSpace::add(dxGeom* geom) {
  CHECK_NOT_LOCKED(this);
  dAASSERT(geom);
  dUASSERT(geom->parent_space == 0 && geom->next == 0, "geom is already in a space");
  dUASSERT(geoms_.size() < most_slots, "too many geoms in a parallel SAP space");

  constexpr std::size_t least_gaps = 64;
  if (geoms_.size() - count >= std::max<std::size_t>(least_gaps, count)) closeSlots();
  // All that may throw comes before the geom is known here.
  const Slot slot = static_cast<Slot>(geoms_.size());
  pair_keeper_.change(slot);
  silent_.growTo(slot + std::size_t{1});
  geoms_.push_back(geom);
  setSlot(geom, slot);
  silent_.add(slot);
  plane_pairs_.forget();
  geom->next = nullptr;
  geom->tome = tail_;
  *tail_ = geom;
  tail_ = &geom->next;
  geom->parent_space = this;
  ++count;
  current_geom = nullptr;

  // A geom that comes clean from elsewhere is new here all the same.
  geom->gflags |= GEOM_DIRTY | GEOM_AABB_BAD;
  dirty(geom);
  dGeomMoved(this);
}

void ParallelSAPSpace::remove(dxGeom* geom) {
  CHECK_NOT_LOCKED(this);
  dAASSERT(geom);
  dUASSERT(geom->parent_space == this, "object is not in this space");

  queries_.changed(slotIn(geom));
  plane_pairs_.forget();
  pair_keeper_.change(static_cast<Slot>(slotIn(geom)));
  silent_.remove(static_cast<Slot>(slotIn(geom)));
  geoms_[slotIn(geom)] = nullptr;
  while (geoms_.size() && !geoms_[geoms_.size() - 1]) geoms_.resize(geoms_.size() - 1);
  clearSlot(geom);
  if (!reported_invalid_.empty()) reported_invalid_.erase(geom);
  if (!geom->next) tail_ = geom->tome;
  dxSpace::remove(geom);
}

void ParallelSAPSpace::dirty(dxGeom* geom) {
  needs_clean_ = true;
  is_still_ = false;
  queries_.changed(slotIn(geom));
  pair_keeper_.change(static_cast<Slot>(slotIn(geom)));
}

// Closes the gaps that removed geoms left, once they are a quarter of all slots.
void ParallelSAPSpace::closeSlots() {
  const std::size_t gaps = geoms_.size() - count;
  if (gaps == 0 || gaps < geoms_.size() / 4) return;
  pair_keeper_.stop();
  silent_.clear();
  std::size_t slot = 0;
  for (dxGeom* const geom : geoms_) {
    if (!geom) continue;
    geoms_[slot] = geom;
    setSlot(geom, slot);
    if (mayBeSilent(geom)) silent_.add(static_cast<Slot>(slot));
    ++slot;
  }
  geoms_.resize(slot);
  queries_.reset();
  plane_pairs_.forget();
}

// Asks the geoms that may be dirty without having said so.
void ParallelSAPSpace::noteSilent() {
  silent_.ask(*this, geoms_.data());
}

void ParallelSAPSpace::addMeshes(std::vector<dxGeom*>& meshes) {
  silent_.addMeshes(geoms_.data(), meshes);
}

void ParallelSAPSpace::cleanGeoms() {
  noteSilent();
  cleanNoted();
}

void ParallelSAPSpace::cleanNoted() {
  if (!needs_clean_) return;
  const Lock lock(*this);
  try {
    geom_update_.clean(geoms_.data(), geoms_.size(), threadsForFrame(), pair_keeper_.changed());
  } catch (const std::bad_alloc&) {
    cleanOneByOne();
  }
  needs_clean_ = false;
}

std::size_t ParallelSAPSpace::cleanOneByOne() {
  std::size_t moved = 0;
  for (dxGeom* geom = first; geom; geom = geom->next) {
    if (!(geom->gflags & GEOM_DIRTY)) continue;
    cleanGeom(geom);
    ++moved;
  }
  return moved;
}

// Called before each frame, for the last one. The storage of the devices stays: it took too long to
// get.
void ParallelSAPSpace::releaseSpareMemory() {
  if (lock_count > 1 || !memory_watch_.isTooMuchAfter(count, stats_.pairs)) return;
  closeSlots();
  geoms_.shrink();
  queries_.release();
  hits_.release();
  pair_keeper_.release();
  geom_update_ = GeomUpdate();
  boxes_ = BoxSet();
  cpu_finders_.reset();
  pair_filter_ = PairFilter();
  plane_pairs_ = PlanePairs();
  pairs_ = PairList();
  kept_ = PairList();
  others_ = PairList();
  kept_apart_ = false;
  contact_pairs_.release();
  narrow_phase_ = NarrowPhase();
}

// By bounds, bits and bodies.
bool ParallelSAPSpace::pairsExactly(dxGeom* a, dxGeom* b) const {
  const ScopedMode mode(exactMode());
  return boxesOverlap(a, b) && filtersMatch(a, b) && !isCulled(a, b);
}

// Needs exactMode().
bool ParallelSAPSpace::isCulled(dxGeom* a, dxGeom* b) const {
  return settings.rules.cull_planes && areClearByPlane(a, b);
}

void ParallelSAPSpace::collide2(void* data, dxGeom* geom, dNearCallback* callback) {
  dAASSERT(geom && callback);
  const Lock lock(*this);
  noteSilent();
  if (IS_SPACE(geom))
    if (ParallelSAPSpace* const other = parallelSAPSpace(static_cast<dxSpace*>(geom)))
      other->noteSilent();
  if (needs_clean_ && queries_.clean(geoms_)) needs_clean_ = false;
  cleanNoted();
  geom->recomputeAABB();
  if (hasNaN(geom) || (IS_SPACE(geom) && static_cast<dxSpace*>(geom)->count == 0)) return;
  // As in collide(), a query within the callback finds the member free.
  Buffer<dxGeom*> hits = std::move(hits_);
  try {
    queries_.find(geoms_, geom, settings.rules.cull_planes, threadsForFrame(), hits);
  } catch (const std::bad_alloc&) {
    queries_.release();
    collide2WithoutMemory(data, geom, callback);
    return;
  }
  std::size_t count = 0;
  for (dxGeom* const own : hits)
    if (passesAABBTests(own, geom)) hits[count++] = own;
  hits.resize(count);
  for (dxGeom* const own : hits) callback(data, own, geom);
  hits_ = std::move(hits);
}

void ParallelSAPSpace::collide2WithoutMemory(void* data, dxGeom* geom, dNearCallback* callback) {
  for (dxGeom* own = first; own; own = own->next) {
    if (!isEnabled(own) || hasNaN(own) || !pairsExactly(own, geom)) continue;
    if (passesAABBTests(own, geom)) callback(data, own, geom);
  }
}

// Where there is no memory to note that it was, rather once more than not at all.
void ParallelSAPSpace::reportInvalid(const dxGeom* geom) {
  bool first = true;
  try {
    first = reported_invalid_.insert(geom).second;
  } catch (const std::bad_alloc&) {
  }
  if (first)
    dMessage(0, "parallel SAP space: geom %p has a NaN in its AABB and is left out of all pairs",
             static_cast<const void*>(geom));
}

void ParallelSAPSpace::reportTooLong(const ListsTooLong& lists) {
  if (!lists_too_long_reported_)
    dMessage(0,
             "parallel SAP space: the method AxisLists would need %.1f MB for the pairs of each "
             "axis and may take %.1f MB; the method Sweep is used where it does not fit",
             static_cast<double>(lists.needed) / 1e6, static_cast<double>(lists.allowed) / 1e6);
  lists_too_long_reported_ = true;
}

void ParallelSAPSpace::countTotals() {
  if (settings.print_stats) totals_.add(stats_);
}

std::size_t ParallelSAPSpace::memoryBytes() const {
  return sizeof *this + geoms_.bytes() + boxes_.bytes() +
         (cpu_finders_ ? cpu_finders_->bytes() : 0) + device_.bytes() + pairs_.bytes() +
         contact_pairs_.bytes() + narrow_phase_.bytes() + queries_.bytes() + hits_.bytes() +
         plane_pairs_.bytes() + silent_.bytes() + kept_.bytes() + others_.bytes() +
         geom_update_.bytes() + pair_keeper_.bytes() + (still_scene_ ? still_scene_->bytes() : 0);
}

const dParallelSAPStats& ParallelSAPSpace::stats() {
  timed_ = true;
  if (stats_.frames) stats_.memory_bytes = memoryBytes();
  return stats_;
}

ParallelSAPSpace* parallelSAPSpace(dSpaceID space) {
  return dynamic_cast<ParallelSAPSpace*>(space);
}

}  // namespace ode_parallel_sap
