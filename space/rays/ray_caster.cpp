#include "space/rays/ray_caster.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <tuple>
#include <type_traits>

#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/contacts/collider_threads.h"
#include "space/geoms/pair_rule.h"
#include "space/queries/ray_bounds.h"

namespace ode_parallel_sap {

namespace {

Region casting("rays: rays"), colliding_on_images("rays: geoms on images");

using Waiting = RayLists::Waiting;
using Block = RayLists::Block;
using Share = RayLists::Share;
using Geoms = GeomTree::Geoms;

// The distance of hits decides, then where the geoms stand. NaN is farther than all else.
bool isNearer(const RayFound& a, const RayFound& b) {
  const dReal p = a.hit.distance, q = b.hit.distance;
  if (p < q || q < p) return p < q;
  if ((p != p) != (q != q)) return q != q;
  return std::tie(a.target.slot, a.target.within, a.contact) <
         std::tie(b.target.slot, b.target.within, b.contact);
}

bool isBefore(const RayFound& a, const RayFound& b) {
  return a.ray != b.ray ? a.ray < b.ray : isNearer(a, b);
}

dParallelSAPRayHit hitOf(dGeomID geom, const dContactGeom& contact) {
  dParallelSAPRayHit hit = {};
  hit.geom = geom;
  hit.distance = contact.depth;
  std::copy_n(contact.pos, 3, hit.pos);
  std::copy_n(contact.normal, 3, hit.normal);
  hit.side = contact.side2;
  return hit;
}

// A ray of ODE's that a thread casts one ray after the other with.
class RayProbe {
 public:
  // As the flags of dParallelSAPSpaceRays, if of each geom only the nearest hit counts. To be made
  // and destroyed by the calling thread.
  RayProbe(int flags, bool nearest) : nearest_(nearest), ray_(dCreateRay(nullptr, 1)) {
    // Forks of ODE have other functions for these.
    if (flags & dParallelSAPRayFirstContact) ray_->gflags |= RAY_FIRSTCONTACT;
    if (flags & dParallelSAPRayBackfaceCull) ray_->gflags |= RAY_BACKFACECULL;
    if ((flags & dParallelSAPRayClosestHit) || nearest) ray_->gflags |= RAY_CLOSEST_HIT;
  }
  ~RayProbe() { dGeomDestroy(ray_); }
  RayProbe(const RayProbe&) = delete;
  RayProbe& operator=(const RayProbe&) = delete;

  // False where it can hit nothing.
  bool aim(const dParallelSAPRay& ray) {
    if (!isRay(ray)) return false;
    const dReal *const at = ray.origin, *const to = ray.direction;
    dGeomRaySet(ray_, at[0], at[1], at[2], to[0], to[1], to[2]);
    dGeomRaySetLength(ray_, ray.length);
    const bool all_bits = ray.category_bits == 0 && ray.collide_bits == 0;
    ray_->category_bits = all_bits ? ~0ul : ray.category_bits;
    ray_->collide_bits = all_bits ? ~0ul : ray.collide_bits;
    ignored_ = ray.ignore;
    updateAABB(ray_);
    return !hasNaN(ray_);
  }
  // Needs exactMode().
  bool pairs(const dxGeom* geom) const {
    return !(ignored_ && geom->body == ignored_) && boxesOverlap(geom, ray_) && isEnabled(geom) &&
           filtersMatch(geom, ray_);
  }
  dxGeom* geom() const { return ray_; }
  const dReal* origin() const { return ray_->final_posr->pos; }
  // As ODE has made it of length 1.
  void direction(dReal* direction) const {
    for (int axis = 0; axis < 3; ++axis) direction[axis] = ray_->final_posr->R[4 * axis + 2];
  }

  // dCollide of the ray and a geom that is or carries `shape`: all contacts, since colliders may
  // find them in no order. Returns their number. A mesh's callbacks may decline the closest hit.
  int collide(dxGeom* geom, dxGeom* shape, ThreadCollider* image) {
    if (nearest_ && shape && shape->type == dTriMeshClass)
      ray_->gflags =
          (ray_->gflags & ~RAY_CLOSEST_HIT) | (runsUserCode(shape) ? 0 : RAY_CLOSEST_HIT);
    for (constexpr int skip = sizeof(dContactGeom);; asked_ = std::min(8 * asked_, most_contacts)) {
      contacts_.resizeDiscarding(static_cast<std::size_t>(asked_));
      dContactGeom* const found = contacts_.data();
      const int count = image ? image->collide(ray_, geom, asked_, found, skip)
                              : collideInTurn(ray_, geom, asked_, found, skip);
      if (count < asked_ || asked_ == most_contacts) return count;
    }
  }
  const dContactGeom& contact(int i) const { return contacts_[static_cast<std::size_t>(i)]; }

  // Whether a contact is the distance along the ray that it says, but for rounding. Of a ray below
  // all ground near it ODE's collider of heightfields makes one above its origin.
  bool isOnRay(const dContactGeom& contact, const dxHeightfield* field) const {
    const dxHeightfieldData& data = *field->m_p_data;
    dReal off = 0, size = std::fabs(contact.depth) + data.m_fWidth + data.m_fDepth;
    for (int axis = 0; axis < 3; ++axis) {
      const dReal from = origin()[axis], along = ray_->final_posr->R[4 * axis + 2];
      off = std::max(off, std::fabs(contact.pos[axis] - (from + contact.depth * along)));
      size += std::fabs(from);
      if (field->final_posr) size += std::fabs(field->final_posr->pos[axis]);
    }
    return !(off > std::sqrt(std::numeric_limits<dReal>::epsilon()) * size);
  }

 private:
  static constexpr int most_contacts = 0xffff;  // of dCollide

  static bool isRay(const dParallelSAPRay& ray) {
    bool finite = true, directed = false;
    for (int axis = 0; axis < 3; ++axis) {
      finite = finite && std::isfinite(ray.origin[axis]) && std::isfinite(ray.direction[axis]);
      directed = directed || ray.direction[axis] != 0;
    }
    return finite && directed && ray.length >= 0;
  }

  const bool nearest_;
  int asked_ = 64;  // fixed: more than almost any geom has
  dxGeom* const ray_;
  dBodyID ignored_ = nullptr;
  Buffer<dContactGeom> contacts_;
};

// A batch on its way.
class Pass {
 public:
  // `tree` is up to date, or null.
  Pass(const GeomTree* tree, const NestedTrees& nested, const Geoms& geoms,
       const RayRequest& request, const BatchWay& way, RayLists& store)
      : tree_(tree),
        nested_(nested),
        geoms_(geoms),
        request_(request),
        way_(way),
        store_(store),
        most_hits_(request.nearest ? 1 : std::max(1, request.flags & 0xffff)) {}

  // Nothing after it needs memory.
  void run(int team) {
    const std::size_t count = static_cast<std::size_t>(team);
    while (probes_.size() < count) probes_.emplace_back(request_.flags, request_.nearest);
    if (store_.shares.size() < count) store_.shares.resize(count);
    for (Share& share : store_.shares) share.clear();
    store_.blocks.resizeDiscarding(request_.count);
    castAll(team);
    collideWaiting(team);
    gather(store_.shares, &Share::late, store_.late);
    std::sort(store_.late.begin(), store_.late.end(), isBefore);
    std::uint32_t most = 0;
    for (const Block& block : store_.blocks) most = std::max(most, block.count);
    store_.hits.reserve(most + store_.late.size());
  }

 private:
  // A ray on its way.
  struct Flight {
    std::size_t ray;
    RayProbe& probe;
    Share& share;
    bool alone;  // no other thread collides
    dReal reach;
    std::size_t first_found;  // of the share
  };

  void castAll(int team) {
    constexpr std::size_t most = grains::cast_rays.work / 4;
    const std::size_t chunk = chunkOf(request_.count, most, team);
    runPartsWithData(casting, team, request_.count, chunk, way_.manual_cleanup,
                     [&](const Range& range, int thread) {
                       for (std::size_t ray = range.begin; ray < range.end; ++ray)
                         castOne(ray, thread, team == 1);
                     });
  }

  // On images, and then in the order of rays what these do not serve.
  void collideWaiting(int threads) {
    Buffer<Waiting>& waiting = store_.waiting;
    gather(store_.shares, &Share::waiting, waiting);
    for (Share& share : store_.shares) share.waiting.resizeDiscarding(0);
    const std::size_t wanted = static_cast<std::size_t>(std::count_if(
        waiting.begin(), waiting.end(), [](const Waiting& each) { return each.for_image; }));
    const ThreadColliders images(teamFor(wanted, grains::heavy_pairs, threads), wanted);
    const int team = std::max(1, images.count());
    runPartsWithData(colliding_on_images, team, waiting.size(),
                     chunkOf(waiting.size(), grains::heavy_pairs.work, team), way_.manual_cleanup,
                     [&](const Range& range, int thread) {
                       for (std::size_t i = range.begin; i < range.end; ++i)
                         if (images.count() && waiting[i].for_image &&
                             images[thread].serves(probes_[0].geom(), waiting[i].geom))
                           collideLate(waiting[i], thread, &images[thread]);
                         else
                           shareOf(thread).waiting.push_back(waiting[i]);
                     });
    gather(store_.shares, &Share::waiting, waiting);
    std::sort(waiting.begin(), waiting.end(), [](const Waiting& a, const Waiting& b) {
      return std::tie(a.ray, a.target.slot, a.target.within) <
             std::tie(b.ray, b.target.slot, b.target.within);
    });
    for (const Waiting& each : waiting) collideLate(each, 0, nullptr);
  }

  Share& shareOf(int thread) const { return store_.shares[static_cast<std::size_t>(thread)]; }

  void castOne(std::size_t ray, int thread, bool alone) {
    RayProbe& probe = probes_[static_cast<std::size_t>(thread)];
    Share& share = shareOf(thread);
    Block& block = store_.blocks[ray];
    block = {share.found.size(), 0, static_cast<std::uint32_t>(thread)};
    const dParallelSAPRay asked = request_.ray(ray);
    if (!probe.aim(asked)) return;
    Flight flight = {ray, probe, share, alone, asked.length, block.first};
    {
      const ScopedMode exact(exactMode());
      if (tree_)
        meetTree(flight, *tree_, geoms_, flight.share.slots[0], [](Slot slot) -> RayTarget {
          return {slot, 0};
        });
      else
        meetAll(flight);
    }
    block.count = static_cast<std::uint32_t>(share.found.size() - block.first);
    std::sort(share.found.begin() + block.first, share.found.end(), isNearer);
  }

  void meetAll(Flight& flight) const {
    for (std::size_t slot = 0; slot < geoms_.size(); ++slot) {
      if (slot + prefetch_distance < geoms_.size())
        if (const dxGeom* const later = geoms_[slot + prefetch_distance]) prefetch(later->aabb);
      if (geoms_[slot]) meet(flight, geoms_[slot], {static_cast<Slot>(slot), 0});
    }
  }

  template <class TargetOf>
  void meetTree(Flight& flight, const GeomTree& tree, const Geoms& geoms, Buffer<Slot>& slots,
                TargetOf targetOf) const {
    const auto meetOwn = [&](Slot slot) { meet(flight, geoms[slot], targetOf(slot)); };
    // Those of a kind and of the next ones that its box overlaps.
    const auto meetByBox = [&](GeomTree::Kind first) {
      tree.find(geoms, flight.probe.geom(), slots, first);
      for (const Slot slot : slots) meetOwn(slot);
    };
    dReal direction[3];
    flight.probe.direction(direction);
    const dReal* const origin = flight.probe.origin();
    if (!isUsualRay(origin, direction)) return meetByBox(GeomTree::bounded);
    tree.withTrees([&](const auto& of) {
      using Real = typename std::remove_reference_t<decltype(of[0])>::RealType;
      Real limit = limitFor<Real>(flight.reach);
      of[GeomTree::bounded].visitAlong(rayQuery<Real>(origin, direction), limit, [&](Slot slot) {
        meetOwn(slot);
        limit = limitFor<Real>(flight.reach);
      });
    });
    meetByBox(GeomTree::other);
  }

  void meet(Flight& flight, dxGeom* geom, RayTarget target) const {
    if (!flight.probe.pairs(geom)) return;
    if (IS_SPACE(geom)) {
      meetWithin(flight, static_cast<dxSpace*>(geom), target);
      return;
    }
    if (way_.filter.isSet()) {
      const ScopedMode programs(mode_);
      if (way_.filter.rejects(request_.first + flight.ray, geom)) return;
    }
    if (flight.alone) {
      const ScopedMode programs(mode_);
      if (passesAABBTests(geom, flight.probe.geom())) hit(flight, geom, target);
      return;
    }
    const ColliderUse use = colliderUse(flight.probe.geom(), geom);
    if (use == ColliderUse::Light || use == ColliderUse::Heavy) {
      const ScopedMode programs(mode_);
      hit(flight, geom, target);
    } else {
      flight.share.waiting.push_back({flight.ray, target, geom, use == ColliderUse::OwnCollider});
    }
  }

  // There slots are as good as places.
  __attribute__((noinline)) void meetNested(Flight& flight, const NestedTree& own) const {
    meetTree(flight, own.tree, own.geoms, flight.share.slots[1], [&](Slot slot) -> RayTarget {
      return {own.slot, slot};
    });
  }

  // As a near callback would that calls dSpaceCollide2 of the ray and the sub-space.
  void meetWithin(Flight& flight, dxSpace* space, RayTarget& target) const {
    if (const NestedTree* const own = nestedAt(nested_, target.slot))
      return meetNested(flight, *own);
    for (dxGeom* geom = space->first; geom; geom = geom->next) {
      if (!IS_SPACE(geom))
        meet(flight, geom, target);
      else if (flight.probe.pairs(geom))
        meetWithin(flight, static_cast<dxSpace*>(geom), target);
      ++target.within;
    }
  }

  void hit(Flight& flight, dxGeom* geom, RayTarget target) const {
    Buffer<RayFound>& all = flight.share.found;
    const std::size_t before = all.size(), first = flight.first_found;
    collide({flight.ray, target, geom, false}, flight.probe, nullptr, all);
    if (!request_.nearest || all.size() == before) return;
    flight.reach = std::min(flight.reach, all[before].hit.distance);
    if (before == first) return;
    if (isNearer(all[before], all[first])) all[first] = all[before];
    all.resize(before);
  }

  void collideLate(const Waiting& waiting, int thread, ThreadCollider* image) {
    RayProbe& probe = probes_[static_cast<std::size_t>(thread)];
    probe.aim(request_.ray(waiting.ray));
    Buffer<RayFound>& late = shareOf(thread).late;
    if (image || passesAABBTests(waiting.geom, probe.geom())) collide(waiting, probe, image, late);
  }

  // Appends the nearest hits of a geom, as many as are wanted.
  void collide(const Waiting& pair, RayProbe& probe, ThreadCollider* image,
               Buffer<RayFound>& found) const {
    const bool is_carrier = pair.geom->type == dGeomTransformClass;
    dxGeom* const shape = is_carrier ? carriedBy(pair.geom) : pair.geom;
    const int count = probe.collide(pair.geom, shape, image);
    if (count == 0) return;
    const auto* const field = shape && shape->type == dHeightfieldClass
                                  ? static_cast<const dxHeightfield*>(shape)
                                  : nullptr;
    const std::size_t before = found.size(), most = before + most_hits_;
    found.resize(before + static_cast<std::size_t>(count));
    RayFound* next = found.begin() + before;
    for (int i = 0; i < count; ++i)
      if (!field || probe.isOnRay(probe.contact(i), field))
        *next++ = {pair.ray, pair.target, static_cast<std::uint32_t>(i),
                   hitOf(pair.geom, probe.contact(i))};
    found.resize(static_cast<std::size_t>(next - found.begin()));
    if (found.size() <= most) return;
    std::nth_element(found.begin() + before, found.begin() + most, found.end(), isNearer);
    found.resize(most);
  }

  const GeomTree* const tree_;
  const NestedTrees& nested_;
  const Geoms& geoms_;
  const RayRequest& request_;
  const BatchWay& way_;
  RayLists& store_;
  const std::size_t most_hits_;  // of a ray and a geom
  std::deque<RayProbe> probes_;  // by thread
  const FloatingPointMode mode_ = currentMode();
};

// Needs no pass: a callback may leave it by longjmp.
std::size_t report(const Scene& scene, const RayRequest& request, RayLists& store) {
  const Reports::Open open(scene.reports, request.all);
  std::size_t all = 0;
  const RayFound* late = store.late.begin();
  for (std::size_t ray = 0; ray < request.count; ++ray) {
    if (request.nearest) request.nearest[ray] = {};
    const Block& block = store.blocks[ray];
    const RayFound* const first_late = late;
    while (late != store.late.end() && late->ray == ray) ++late;
    std::size_t count = block.count + static_cast<std::size_t>(late - first_late);
    store.hits.resizeDiscarding(count);
    const RayFound* a = store.shares[block.thread].found.data() + block.first;
    const RayFound *const a_end = a + block.count, *b = first_late;
    dParallelSAPRayHit* next = store.hits.data();
    for (; count > 0; --count) {
      const RayFound& found = a != a_end && (b == late || isNearer(*a, *b)) ? *a++ : *b++;
      *next = found.hit;
      next += !scene.reports.changed() ||
              scene.reports.holds(scene.slots, found.target.slot, found.hit.geom);
    }
    count = static_cast<std::size_t>(next - store.hits.data());
    if (count == 0) continue;
    if (request.nearest)
      request.nearest[ray] = store.hits[0];
    else
      request.all(request.data, request.first + ray, store.hits.data(), count);
    all += request.nearest ? 1 : count;
  }
  return all;
}

}  // namespace

std::size_t castRays(const Scene& scene, GeomTree& tree, const RayRequest& request,
                     const BatchWay& way, RayLists& lists, NestedTrees nested) {
  if (request.count == 0) return 0;
  const auto find = [&](const GeomTree* by, const RayRequest& rays, int threads) {
    const int team = teamFor(rays.count, grains::cast_rays, threads);
    Pass(by, nested, scene.slots, rays, way, lists).run(team);
  };
  return runBatch(scene, tree, request, way, lists, nested, find,
                  [&](const RayRequest& rays) { return report(scene, rays, lists); });
}

}  // namespace ode_parallel_sap
