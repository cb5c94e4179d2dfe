#include "space/geoms/scene.h"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <mutex>
#include <new>
#include <typeinfo>

namespace ode_parallel_sap {

namespace {

// A space with a list of geoms: ~dxGeom has made one that is destroyed one of the base class.
bool isWholeSpace(const dxGeom* geom) {
  return IS_SPACE(geom) && typeid(*geom) != typeid(dxGeom);
}

bool isIn(const dxSpace* space, const dxGeom* geom) {
  for (const dxGeom* own = space->first; own; own = own->next)
    if (own == geom || (IS_SPACE(own) && isIn(static_cast<const dxSpace*>(own), geom))) return true;
  return false;
}

}  // namespace

int Edits::stampOf(dxSpace* space) {
  static std::atomic<unsigned> stamps{0};
  if (!isStamped(space)) {
    space->current_geom = space;
    space->current_index = -2 - static_cast<int>(stamps.fetch_add(1) & 0x3fffffff);
  }
  return space->current_index;
}

bool Edits::isFresh(const Tracked& tracked) {
  return !tracked.stale &&
         std::all_of(tracked.spaces.begin(), tracked.spaces.end(), [](const Stamped& each) {
           return isStamped(each.space) && each.space->current_index == each.stamp;
         });
}

// A geom without the flag is new at its address: ODE sets all of gflags when it makes a geom, and
// uses the lower bits. Many threads use it, each for geoms of its own.
class Edits::Identities {
 public:
  std::uint64_t of(dxGeom* geom) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::uint64_t& number = numbers_[geom];
    if (!(geom->gflags & flag) || number == 0) number = ++last_;
    geom->gflags |= flag;
    return number;
  }

 private:
  static constexpr int flag = 1 << 24;
  std::mutex mutex_;
  std::unordered_map<const dxGeom*, std::uint64_t> numbers_;
  std::uint64_t last_ = 0;
};

Edits::Tables::Tables() {
  static std::mutex mutex;
  static std::weak_ptr<Identities> shared;
  const std::lock_guard<std::mutex> lock(mutex);
  identities = shared.lock();
  if (!identities) shared = identities = std::make_shared<Identities>();
}

// Calls change(tracked), which may take place already, once the sub-space's geoms are known.
template <class Change>
void Edits::track(const Geoms& geoms, Slot slot, Change change) {
  noteChange();
  if (lost_ || !geoms[slot]) return;
  try {
    if (!tables_) tables_ = std::make_unique<Tables>();
    Tracked& tracked = tables_->tracked[slot];
    if (tracked.scan == 0) scan(slot, static_cast<dxSpace*>(geoms[slot]), tracked);
    change(tracked);
  } catch (const std::bad_alloc&) {
    forgetAll(/*for_want_of_memory=*/true);
  }
}

void Edits::noteWithin(const Geoms& geoms, Slot slot) {
  track(geoms, slot, [](Tracked&) {});
}

// A geom has no class while it is made: it may be a space.
void Edits::noteCame(const Geoms& geoms, Slot slot, dxGeom* geom) {
  track(geoms, slot, [&](Tracked& tracked) {
    forget(geom);
    if (geom->type < 0 || IS_SPACE(geom))
      tracked.stale = true;
    else
      tables_->known[geom] = {slot, tracked.scan, tables_->identities->of(geom), now_};
  });
}

void Edits::noteLeaving(const Geoms& geoms, Slot slot, const dxGeom* geom) {
  track(geoms, slot, [&](Tracked& tracked) {
    forget(geom);
    tracked.stale = tracked.stale || IS_SPACE(geom);
  });
}

void Edits::forget(const dxGeom* geom) {
  tables_->known.erase(geom);
  if (isWholeSpace(geom))
    for (const dxGeom* own = static_cast<const dxSpace*>(geom)->first; own; own = own->next)
      forget(own);
}

// At the first scan of a sub-space nothing had come there.
void Edits::scan(Slot slot, dxSpace* space, Tracked& tracked) {
  tracked.spaces.clear();
  tracked.stale = false;
  scanWithin(slot, space, tracked, tracked.scan++ == 0 ? 0 : now_);
}

void Edits::scanWithin(Slot slot, dxSpace* space, Tracked& tracked, std::uint64_t came) {
  tracked.spaces.push_back({space, stampOf(space)});
  for (dxGeom* geom = space->first; geom; geom = geom->next) {
    if (IS_SPACE(geom)) {
      if (isWholeSpace(geom)) scanWithin(slot, static_cast<dxSpace*>(geom), tracked, came);
      continue;
    }
    if (geom->type < 0) tracked.stale = true;  // it is being made, and may be a space
    Known& known = tables_->known[geom];
    const std::uint64_t identity = tables_->identities->of(geom);
    const bool stayed = known.identity == identity && known.slot == slot && known.scan > 0 &&
                        known.scan + 1 == tracked.scan;
    known = {slot, tracked.scan, identity, stayed ? known.came : came};
  }
}

void Edits::updateAll(const Geoms& geoms) try {
  auto& tracked = tables_->tracked;
  for (auto each = tracked.begin(); each != tracked.end();) {
    dxGeom* const space = geoms[each->first];
    if (space && !isFresh(each->second))
      scan(each->first, static_cast<dxSpace*>(space), each->second);
    each = space ? std::next(each) : tracked.erase(each);
  }
} catch (const std::bad_alloc&) {
  forgetAll(/*for_want_of_memory=*/true);
}

bool Edits::holds(const Geoms& geoms, Slot slot, const dxGeom* geom, std::uint64_t begin) {
  dxGeom* const now = geoms[slot];
  if (!now || now == geom) return now != nullptr;
  dxSpace* const space = static_cast<dxSpace*>(now);
  if (!tables_) return !lost_ || isIn(space, geom);
  const auto tracked = tables_->tracked.find(slot);
  if (tracked == tables_->tracked.end()) return !lost_ || isIn(space, geom);
  try {
    if (!isFresh(tracked->second)) scan(slot, space, tracked->second);
  } catch (const std::bad_alloc&) {
    forgetAll(/*for_want_of_memory=*/true);
    return isIn(space, geom);
  }
  const auto known = tables_->known.find(geom);
  return known != tables_->known.end() && known->second.slot == slot &&
         known->second.scan == tracked->second.scan && known->second.came < begin;
}

}  // namespace ode_parallel_sap
