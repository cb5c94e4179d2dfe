#include "space/rays/ray_caster.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <tuple>
#include <type_traits>

#include "space/base/platform.h"
#include "space/geoms/pair_rule.h"
#include "space/queries/ray_bounds.h"

namespace ode_parallel_sap {

namespace {

Region casting("rays: rays"), colliding_on_images("rays: geoms on images");

using Waiting = RayLists::Waiting;
using Share = RayLists::Share;

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
    const dReal *const at = ray.origin, *const to = ray.direction;
    bool usable = ray.length >= 0, directed = false;
    for (int axis = 0; axis < 3; ++axis) {
      usable = usable && std::isfinite(at[axis]) && std::isfinite(to[axis]);
      directed = directed || to[axis] != 0;
    }
    if (!usable || !directed) return false;
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
  void direction(dReal* to) const { dGetMatrixColumn3(to, ray_->final_posr->R, 2); }

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

  const bool nearest_;
  int asked_ = 64;  // fixed: more than almost any geom has
  dxGeom* const ray_;
  dBodyID ignored_ = nullptr;
  Buffer<dContactGeom> contacts_;
};

struct Pass : BatchPass<RayRequest, RayLists> {
  std::deque<RayProbe> probes = {};  // by thread

  // Nothing after it needs memory.
  void run() {
    while (probes.size() < static_cast<std::size_t>(team()))
      probes.emplace_back(request.flags, request.nearest);
    findAll(casting,
            [this](std::size_t ray, int thread, bool alone) { castOne(ray, thread, alone); });
    collideWaiting();
    gather(lists.shares, &Share::late, lists.late);
    std::sort(lists.late.begin(), lists.late.end(), isBefore);
    std::uint32_t most = 0;
    for (const BatchBlock& block : lists.blocks) most = std::max(most, block.count);
    lists.hits.reserve(most + lists.late.size());
  }

  // A ray on its way.
  struct Flight {
    std::size_t ray;
    RayProbe& probe;
    Share& share;
    bool alone;  // no other thread collides
    dReal reach;
    std::size_t first_found;  // of the share
  };

  // On images, and then in the order of rays what these do not serve.
  void collideWaiting() {
    Buffer<Waiting>& waiting = lists.waiting;
    gather(lists.shares, &Share::waiting, waiting);
    for (Share& share : lists.shares) share.waiting.resizeDiscarding(0);
    const std::size_t wanted = static_cast<std::size_t>(std::count_if(
        waiting.begin(), waiting.end(), [](const Waiting& each) { return each.for_image; }));
    const ThreadColliders images(teamFor(wanted, grains::heavy_pairs, team()), wanted);
    const int threads = std::max(1, images.count());
    runPartsWithData(colliding_on_images, threads, waiting.size(),
                     chunkOf(waiting.size(), grains::heavy_pairs.work, threads), way.manual_cleanup,
                     [&](const Range& range, int thread) {
                       for (std::size_t i = range.begin; i < range.end; ++i)
                         if (images.count() && waiting[i].for_image &&
                             images[thread].serves(probes[0].geom(), waiting[i].geom))
                           collideLate(waiting[i], thread, &images[thread]);
                         else
                           lists.shares[thread].waiting.push_back(waiting[i]);
                     });
    gather(lists.shares, &Share::waiting, waiting);
    std::sort(waiting.begin(), waiting.end(), [](const Waiting& a, const Waiting& b) {
      return std::tie(a.ray, a.target.slot, a.target.within) <
             std::tie(b.ray, b.target.slot, b.target.within);
    });
    for (const Waiting& each : waiting) collideLate(each, 0, nullptr);
  }

  void castOne(std::size_t ray, int thread, bool alone) {
    RayProbe& probe = probes[thread];
    Share& share = lists.shares[thread];
    BatchBlock& block = lists.blocks[ray] = {share.found.size(), 0, thread};
    const dParallelSAPRay asked = request.ray(ray);
    if (!probe.aim(asked)) return;
    Flight flight = {ray, probe, share, alone, asked.length, block.first};
    {
      const ScopedMode exact(exactMode());
      tree ? meetTree(flight, nullptr) : meetAll(flight);
    }
    block.count = static_cast<std::uint32_t>(share.found.size() - block.first);
    std::sort(share.found.begin() + block.first, share.found.end(), isNearer);
  }

  void meetAll(Flight& flight) const {
    const GeomTree::Geoms& geoms = scene.slots;
    for (std::size_t slot = 0; slot < geoms.size(); ++slot) {
      if (slot + prefetch_distance < geoms.size())
        if (const dxGeom* const later = geoms[slot + prefetch_distance]) prefetch(later->aabb);
      if (geoms[slot]) meet(flight, geoms[slot], {static_cast<Slot>(slot), 0});
    }
  }

  // Of the space, or of a sub-space: there slots are as good as places.
  __attribute__((noinline)) void meetTree(Flight& flight, const NestedTree* within) const {
    const GeomTree& own = within ? within->tree : *tree;
    const GeomTree::Geoms& geoms = within ? within->geoms : scene.slots;
    Buffer<Slot>& slots = flight.share.slots[within != nullptr];
    const auto meetOwn = [&](Slot slot) {
      meet(flight, geoms[slot], within ? RayTarget{within->slot, slot} : RayTarget{slot, 0});
    };
    // Those of a kind and of the next ones that its box overlaps.
    const auto meetByBox = [&](GeomTree::Kind first) {
      own.find(geoms, flight.probe.geom(), slots, first);
      for (const Slot slot : slots) meetOwn(slot);
    };
    dReal direction[3];
    flight.probe.direction(direction);
    const dReal* const origin = flight.probe.origin();
    if (!isUsualRay(origin, direction)) return meetByBox(GeomTree::bounded);
    own.withTrees([&](const auto& of) {
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
    if (IS_SPACE(geom)) return meetWithin(flight, static_cast<dxSpace*>(geom), target);
    if (rejects(flight.ray, geom)) return;
    dxGeom* const ray = flight.probe.geom();
    const ColliderUse use = flight.alone ? ColliderUse::Light : colliderUse(ray, geom);
    const bool for_image = use == ColliderUse::OwnCollider;
    if (for_image || use == ColliderUse::CallingThread)
      return flight.share.waiting.push_back({flight.ray, target, geom, for_image});
    const ScopedMode programs(mode);
    if (passesAABBTests(geom, ray)) hit(flight, geom, target);
  }

  // As a near callback would that calls dSpaceCollide2 of the ray and the sub-space.
  void meetWithin(Flight& flight, dxSpace* space, RayTarget& target) const {
    if (const NestedTree* const own = nestedAt(nested, target.slot)) return meetTree(flight, own);
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
    if (!request.nearest || all.size() == before) return;
    flight.reach = std::min(flight.reach, all[before].hit.distance);
    if (before == first) return;
    if (isNearer(all[before], all[first])) all[first] = all[before];
    all.resize(before);
  }

  void collideLate(const Waiting& waiting, int thread, ThreadCollider* image) {
    RayProbe& probe = probes[thread];
    probe.aim(request.ray(waiting.ray));
    Buffer<RayFound>& late = lists.shares[thread].late;
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
    const std::size_t before = found.size();
    const std::size_t most = before + (request.nearest ? 1 : std::max(1, request.flags & 0xffff));
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

  // Needs no pass: a callback may leave it by longjmp.
  static std::size_t report(const Scene& scene, const RayRequest& request, RayLists& lists) {
    const Reports::Open open(scene.reports, request.all);
    std::size_t all = 0;
    const RayFound* late = lists.late.begin();
    for (std::size_t ray = 0; ray < request.count; ++ray) {
      if (request.nearest) request.nearest[request.first + ray] = {};
      const BatchBlock& block = lists.blocks[ray];
      const RayFound* const first_late = late;
      while (late != lists.late.end() && late->ray == ray) ++late;
      std::size_t count = block.count + static_cast<std::size_t>(late - first_late);
      lists.hits.resizeDiscarding(count);
      const RayFound* a = lists.shares[block.thread].found.data() + block.first;
      const RayFound *const a_end = a + block.count, *b = first_late;
      dParallelSAPRayHit* next = lists.hits.data();
      for (; count > 0; --count) {
        const RayFound& found = a != a_end && (b == late || isNearer(*a, *b)) ? *a++ : *b++;
        *next = found.hit;
        next += !scene.reports.changed() ||
                scene.reports.holds(scene.slots, found.target.slot, found.hit.geom);
      }
      count = static_cast<std::size_t>(next - lists.hits.data());
      if (count == 0) continue;
      if (request.nearest)
        request.nearest[request.first + ray] = lists.hits[0];
      else
        request.all(request.data, request.first + ray, lists.hits.data(), count);
      all += request.nearest ? 1 : count;
    }
    return all;
  }
};

}  // namespace

std::size_t castRays(const Scene& scene, GeomTree& tree, const RayRequest& request,
                     const BatchWay& way, RayLists& lists, NestedTrees nested) {
  return request.count ? runBatch<Pass>(scene, tree, request, way, lists, std::move(nested)) : 0;
}

}  // namespace ode_parallel_sap
