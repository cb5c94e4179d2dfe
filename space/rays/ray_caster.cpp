#include "space/rays/ray_caster.h"

#include <algorithm>
#include <deque>
#include <new>
#include <tuple>
#include <type_traits>
#include <utility>

#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/contacts/collider_threads.h"
#include "space/contacts/thread_colliders.h"
#include "space/geoms/pair_rule.h"
#include "space/rays/ray_probe.h"

namespace ode_parallel_sap {

namespace {

Region casting("rays: rays"), colliding_on_images("rays: geoms on images");

using Waiting = RayLists::Waiting;
using Block = RayLists::Block;
using Share = RayLists::Share;

bool pairs(const dxGeom* geom, const dxGeom* ray) {
  return boxesOverlap(geom, ray) && isEnabled(geom) && filtersMatch(geom, ray);
}

}  // namespace

// A batch on its way.
class RayCaster::Pass {
 public:
  Pass(const RayCaster& caster, const Geoms& geoms, const RayRequest& request, RayLists& store)
      : caster_(caster), geoms_(geoms), request_(request), store_(store) {}

  void begin(int threads, bool trees);
  void castAll(int threads, bool manual_cleanup);
  void collideOnImages(int threads, bool manual_cleanup);
  void collideRest();
  // Sorts what came late, and makes room for the hits of a ray. Nothing after it needs memory.
  void gatherLate();
  // What then is reported needs no pass: a callback may leave it by longjmp.
  static std::size_t tell(const RayRequest& request, RayLists& store) {
    return request.nearest ? tellNearest(request, store) : tellAll(request, store);
  }

 private:
  static std::size_t tellNearest(const RayRequest& request, const RayLists& store);
  static std::size_t tellAll(const RayRequest& request, RayLists& store);

  // A ray on its way.
  struct Flight {
    std::size_t ray;
    RayProbe& probe;
    Share& share;
    bool alone;  // no other thread collides
    dReal reach;
    RayFound nearest;
    std::size_t waiting;
  };

  void castOne(std::size_t ray, int thread, bool alone);
  void meetAll(Flight& flight) const;
  void meetBounded(Flight& flight) const;
  void meetOthers(Flight& flight, const GeomTree& tree) const;
  void meet(Flight& flight, dxGeom* geom, RayTarget target) const;
  void meetWithin(Flight& flight, dxSpace* space, RayTarget& target) const;
  void hit(Flight& flight, dxGeom* geom, RayTarget target) const;
  void land(Flight& flight, int thread) const;
  void collideLate(const Waiting& waiting, int thread, ThreadCollider* image);

  const RayCaster& caster_;
  const Geoms& geoms_;
  const RayRequest& request_;
  RayLists& store_;
  std::deque<RayProbe> probes_;  // by thread
  const FloatingPointMode mode_ = currentMode();
  bool trees_ = false;
};

// What the calling thread alone may ask ODE for.
void RayCaster::Pass::begin(int threads, bool trees) {
  trees_ = trees;
  const std::size_t team = static_cast<std::size_t>(threads);
  // The nearest of a mesh's triangles is what ODE looks for only then.
  const int flags = request_.flags | (request_.nearest ? dParallelSAPRayClosestHit : 0);
  while (probes_.size() < team) probes_.emplace_back(flags);
  if (store_.shares.size() < team) store_.shares.resize(team);
  for (Share& share : store_.shares) share.clear(trees ? geoms_.size() : 0);
  if (!request_.nearest) store_.blocks.resizeDiscarding(request_.count);
}

void RayCaster::Pass::castAll(int threads, bool manual_cleanup) {
  constexpr std::size_t most = grains::cast_rays.work / 4;
  const int team = teamFor(request_.count, grains::cast_rays, threads);
  const std::size_t chunk = chunkOf(request_.count, most, team);
  runPartsWithData(casting, team, request_.count, chunk, manual_cleanup,
                   [&](const Range& range, int thread) {
                     for (std::size_t ray = range.begin; ray < range.end; ++ray)
                       castOne(ray, thread, team == 1);
                   });
}

void RayCaster::Pass::castOne(std::size_t ray, int thread, bool alone) {
  RayProbe& probe = probes_[static_cast<std::size_t>(thread)];
  Share& share = store_.shares[static_cast<std::size_t>(thread)];
  if (request_.nearest)
    request_.nearest[ray] = {};
  else
    store_.blocks[ray] = {share.found.size(), 0, static_cast<std::uint32_t>(thread)};
  const dParallelSAPRay& asked = request_.rays[ray];
  if (!probe.aim(asked)) return;
  Flight flight = {ray, probe, share, alone, asked.length, {}, 0};
  flight.nearest.ray = ray;
  {
    const ScopedMode exact(exactMode());
    if (trees_) {
      meetBounded(flight);
      meetOthers(flight, caster_.others_);
    } else {
      meetAll(flight);
    }
  }
  land(flight, thread);
}

void RayCaster::Pass::meetAll(Flight& flight) const {
  for (std::size_t slot = 0; slot < geoms_.size(); ++slot) {
    if (slot + prefetch_distance < geoms_.size())
      if (const dxGeom* const later = geoms_[slot + prefetch_distance]) prefetch(later->aabb);
    if (geoms_[slot]) meet(flight, geoms_[slot], {static_cast<Slot>(slot), 0});
  }
}

void RayCaster::Pass::meetBounded(Flight& flight) const {
  dReal direction[3];
  flight.probe.direction(direction);
  const dReal* const origin = flight.probe.origin();
  if (!isUsualRay(origin, direction)) {
    meetOthers(flight, caster_.bounded_);
    return;
  }
  caster_.bounded_.withTree([&](const auto& tree) {
    using Real = typename std::remove_reference<decltype(tree)>::type::RealType;
    Real limit = limitFor<Real>(flight.reach);
    tree.visitAlong(rayQuery<Real>(origin, direction), limit, [&](Slot slot) {
      meet(flight, geoms_[slot], {slot, 0});
      limit = limitFor<Real>(flight.reach);
    });
  });
}

// Those that its box overlaps.
void RayCaster::Pass::meetOthers(Flight& flight, const GeomTree& of) const {
  of.withTree([&](const auto& tree) {
    using Real = typename std::remove_reference<decltype(tree)>::type::RealType;
    if (tree.holdsNone()) return;
    bool coarse;
    Slot* const slots = flight.share.slots.data();
    const std::size_t count = tree.find(boxOf<Real>(flight.probe.geom(), coarse), slots);
    for (std::size_t i = 0; i < count; ++i) {
      const Slot slot = slots[i] & ~borderline_slot;
      meet(flight, geoms_[slot], {slot, 0});
    }
  });
}

void RayCaster::Pass::meet(Flight& flight, dxGeom* geom, RayTarget target) const {
  if (!pairs(geom, flight.probe.geom())) return;
  if (IS_SPACE(geom)) {
    meetWithin(flight, static_cast<dxSpace*>(geom), target);
    return;
  }
  if (flight.alone) {
    const ScopedMode programs(mode_);
    if (passesAABBTests(geom, flight.probe.geom())) hit(flight, geom, target);
    return;
  }
  switch (colliderUse(flight.probe.geom(), geom)) {
    case ColliderUse::Light:
    case ColliderUse::Heavy: {
      const ScopedMode programs(mode_);
      hit(flight, geom, target);
      break;
    }
    case ColliderUse::OwnCollider:
      flight.share.image.push_back({flight.ray, target, geom});
      ++flight.waiting;
      break;
    case ColliderUse::CallingThread:
      flight.share.calling_thread.push_back({flight.ray, target, geom});
      ++flight.waiting;
      break;
  }
}

// As a near callback would that calls dSpaceCollide2 of the ray and the sub-space.
void RayCaster::Pass::meetWithin(Flight& flight, dxSpace* space, RayTarget& target) const {
  for (dxGeom* geom = space->first; geom; geom = geom->next) {
    if (!IS_SPACE(geom))
      meet(flight, geom, target);
    else if (pairs(geom, flight.probe.geom()))
      meetWithin(flight, static_cast<dxSpace*>(geom), target);
    ++target.within;
  }
}

void RayCaster::Pass::hit(Flight& flight, dxGeom* geom, RayTarget target) const {
  const int count = flight.probe.collide(geom, nullptr);
  for (int i = 0; i < count; ++i) {
    const RayFound found = {flight.ray, target, static_cast<std::uint32_t>(i),
                            hitOf(geom, flight.probe.contact(i))};
    if (!request_.nearest) {
      flight.share.found.push_back(found);
    } else if (!flight.nearest.hit.geom || isNearer(found, flight.nearest)) {
      flight.nearest = found;
      if (found.hit.distance < flight.reach) flight.reach = found.hit.distance;
    }
  }
}

void RayCaster::Pass::land(Flight& flight, int thread) const {
  if (!request_.nearest) {
    Block& block = store_.blocks[flight.ray];
    Buffer<RayFound>& found = store_.shares[static_cast<std::size_t>(thread)].found;
    block.count = static_cast<std::uint32_t>(found.size() - block.first);
    std::sort(found.begin() + block.first, found.end(), isNearer);
  } else if (flight.nearest.hit.geom) {
    request_.nearest[flight.ray] = flight.nearest.hit;
    if (flight.waiting) flight.share.late.push_back(flight.nearest);
  }
}

void RayCaster::Pass::collideLate(const Waiting& waiting, int thread, ThreadCollider* image) {
  RayProbe& probe = probes_[static_cast<std::size_t>(thread)];
  probe.aim(request_.rays[waiting.ray]);
  if (!image && !passesAABBTests(waiting.geom, probe.geom())) return;
  const int count = probe.collide(waiting.geom, image);
  for (int i = 0; i < count; ++i)
    store_.shares[static_cast<std::size_t>(thread)].late.push_back(
        {waiting.ray, waiting.target, static_cast<std::uint32_t>(i),
         hitOf(waiting.geom, probe.contact(i))});
}

void RayCaster::Pass::collideOnImages(int threads, bool manual_cleanup) {
  gather(store_.shares, &Share::image, store_.waiting);
  const Buffer<Waiting>& waiting = store_.waiting;
  const ThreadColliders images(teamFor(waiting.size(), grains::heavy_pairs, threads),
                               waiting.size());
  if (images.count() == 0) {
    for (const Waiting& each : waiting) store_.shares[0].calling_thread.push_back(each);
    return;
  }
  const std::size_t chunk = chunkOf(waiting.size(), grains::heavy_pairs.work, images.count());
  runPartsWithData(
      colliding_on_images, images.count(), waiting.size(), chunk, manual_cleanup,
      [&](const Range& range, int thread) {
        for (std::size_t i = range.begin; i < range.end; ++i)
          if (images[thread].serves(probes_[0].geom(), waiting[i].geom))
            collideLate(waiting[i], thread, &images[thread]);
          else
            store_.shares[static_cast<std::size_t>(thread)].calling_thread.push_back(waiting[i]);
      });
}

void RayCaster::Pass::collideRest() {
  gather(store_.shares, &Share::calling_thread, store_.waiting);
  std::sort(store_.waiting.begin(), store_.waiting.end(), [](const Waiting& a, const Waiting& b) {
    return std::tie(a.ray, a.target.slot, a.target.within) <
           std::tie(b.ray, b.target.slot, b.target.within);
  });
  for (const Waiting& waiting : store_.waiting) collideLate(waiting, 0, nullptr);
}

void RayCaster::Pass::gatherLate() {
  gather(store_.shares, &Share::late, store_.late);
  std::sort(store_.late.begin(), store_.late.end(), isBefore);
  if (request_.nearest) return;
  std::uint32_t most = 0;
  for (const Block& block : store_.blocks) most = std::max(most, block.count);
  store_.hits.reserve(most + store_.late.size());
}

std::size_t RayCaster::Pass::tellNearest(const RayRequest& request, const RayLists& store) {
  for (std::size_t i = 0; i < store.late.size(); ++i)
    if (i == 0 || store.late[i].ray != store.late[i - 1].ray)
      request.nearest[store.late[i].ray] = store.late[i].hit;
  std::size_t hits = 0;
  for (std::size_t ray = 0; ray < request.count; ++ray)
    hits += request.nearest[ray].geom != nullptr;
  return hits;
}

std::size_t RayCaster::Pass::tellAll(const RayRequest& request, RayLists& store) {
  std::size_t all = 0;
  const RayFound* late = store.late.begin();
  for (std::size_t ray = 0; ray < request.count; ++ray) {
    const Block& block = store.blocks[ray];
    const RayFound* const found = store.shares[block.thread].found.data() + block.first;
    const RayFound* const first_late = late;
    while (late != store.late.end() && late->ray == ray) ++late;
    const std::size_t count = block.count + static_cast<std::size_t>(late - first_late);
    if (count == 0) continue;
    store.hits.resizeDiscarding(count);
    const RayFound *a = found, *const a_end = found + block.count, *b = first_late;
    for (dParallelSAPRayHit& hit : store.hits)
      hit = a != a_end && (b == late || isNearer(*a, *b)) ? a++->hit : b++->hit;
    request.all(request.data, request.first + ray, store.hits.data(), count);
    all += count;
  }
  return all;
}

// Whether there are trees.
bool RayCaster::prepare(const Geoms& geoms, const RayRequest& request, const Way& way) {
  const ScopedMode mode(exactMode());
  const double queries = static_cast<double>(request.count);
  const bool bounded = bounded_.bringUpToDate(geoms, way.threads, queries);
  return others_.bringUpToDate(geoms, way.threads, queries) && bounded;
}

std::size_t RayCaster::cast(const Geoms& geoms, const RayRequest& request, const Way& way,
                            RayLists& lists) {
  if (request.count == 0) return 0;
  try {
    Pass pass(*this, geoms, request, lists);
    pass.begin(way.threads, prepare(geoms, request, way));
    pass.castAll(way.threads, way.manual_cleanup);
    pass.collideOnImages(way.threads, way.manual_cleanup);
    pass.collideRest();
    pass.gatherLate();
  } catch (const std::bad_alloc&) {
    lists = RayLists();
    release();
    return castOneByOne(geoms, request, lists);
  }
  return Pass::tell(request, lists);
}

// Without trees, and with memory for the hits of one ray.
std::size_t RayCaster::castOneByOne(const Geoms& geoms, const RayRequest& request,
                                    RayLists& lists) {
  std::size_t hits = 0;
  for (std::size_t ray = 0; ray < request.count; ++ray) {
    const RayRequest one = {request.rays + ray, 1,
                            request.flags,      request.nearest ? request.nearest + ray : nullptr,
                            request.data,       request.all,
                            request.first + ray};
    try {
      Pass pass(*this, geoms, one, lists);
      pass.begin(1, false);
      pass.castAll(1, false);
      pass.gatherLate();
    } catch (const std::bad_alloc&) {
      dDebug(0, "parallel SAP space: no memory for the hits of one ray");
    }
    hits += Pass::tell(one, lists);
    lists = RayLists();
  }
  return hits;
}

}  // namespace ode_parallel_sap
