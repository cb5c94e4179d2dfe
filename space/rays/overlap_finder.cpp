#include "space/rays/overlap_finder.h"

#include <atomic>
#include <thread>

#include "space/base/tuning.h"
#include "space/contacts/collider_threads.h"
#include "space/geoms/geom_tests.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

Region finding("overlaps: probes");

using Share = OverlapLists::Share;
using Block = OverlapLists::Block;

constexpr int nobody = -1;  // no thread

// A batch on its way.
struct Pass {
  const Scene& scene;
  const PackRules& rules;
  const OverlapRequest& request;
  const BatchWay& way;
  const int threads;
  OverlapLists& lists;
  const GeomTree* const tree;  // or null
  const NestedTrees& nested;
  const FloatingPointMode programs_mode = currentMode();
  std::atomic<bool> updating[64] = {};  // by geom; fixed: seldom one for two of them

  void run() {
    const std::size_t count = request.count;
    const int team = teamFor(count, grains::cast_rays, threads);
    if (lists.shares.size() < static_cast<std::size_t>(team)) lists.shares.resize(team);
    for (Share& share : lists.shares) share.resize(0);
    lists.blocks.resizeDiscarding(count);
    if (team > 1) prepareThoseInSpaces();
    runPartsWithData(finding, team, count, chunkOf(count, grains::cast_rays.work / 4, team),
                     way.manual_cleanup, [&](const Range& range, int thread) {
                       for (std::size_t i = range.begin; i < range.end; ++i)
                         find(i, thread, /*alone=*/team == 1);
                     });
    for (std::size_t i = 0; i < count; ++i)
      if (lists.blocks[i].thread == nobody) find(i, 0, /*alone=*/true);
    listAll();
    const ContactRequest contacts = {nullptr, request.flags, {}};
    lists.narrow_phase.run(lists.all.pairs, contacts, threads, way.manual_cleanup);
  }

  void prefetchLater(std::size_t i) const {
    if (i + prefetch_distance < request.count)
      prefetchObject(request.probes[i + prefetch_distance].geom, sizeof(dxGeom));
  }

  // Another thread may be bringing the geoms of such a space up to date. The calling thread waits
  // for that, and no other.
  void prepareThoseInSpaces() const {
    for (std::size_t i = 0; i < request.count; ++i) {
      prefetchLater(i);
      dxGeom* const geom = request.probes[i].geom;
      if (geom && geom->parent_space) request.prepare(geom);
    }
  }

  void find(std::size_t i, int thread, bool alone) {
    dParallelSAPProbe& probe = request.probes[i];
    prefetchLater(i);
    Share& share = lists.shares[static_cast<std::size_t>(thread)];
    Block& block = lists.blocks[i] = {share.pairs.size(), 0, thread};
    probe.touched = 0;
    if (alone)
      request.prepare(probe.geom);
    else if (!update(probe.geom))
      block.thread = nobody;
    if (block.thread == nobody || hasNaN(probe.geom)) return;
    {
      const ScopedMode exact(exactMode());
      findHits(tree, scene.slots, probe.geom, rules, share.query);
      for (dxGeom* const geom : share.query.hits)
        if (!add(i, geom, Slots::slotOf(geom), alone, share)) block.thread = nobody;
    }
    if (block.thread == nobody) return share.resize(block.first);
    if (request.any) probe.touched = collideAny(block.first, alone, share);
    block.count = static_cast<std::uint32_t>(share.pairs.size() - block.first);
  }

  // False where that is left to the calling thread, which complains, too.
  bool update(dxGeom* geom) {
    if (!geom || needsCallingThread(geom) || (request.swept && geom->parent_space)) return false;
    if (!geom->parent_space) updateInTurn(geom);
    return !hasNaN(geom);
  }

  // Several probes may be one geom.
  void updateInTurn(dxGeom* geom) {
    const std::uint64_t hash = reinterpret_cast<std::uintptr_t>(geom) * 0x9e3779b97f4a7c15u;
    std::atomic<bool>& taken = updating[hash >> 58];
    while (taken.exchange(true, std::memory_order_acquire)) std::this_thread::yield();
    updateAABB(geom);
    taken.store(false, std::memory_order_release);
  }

  // As a near callback would that calls dSpaceCollide2 of the probe and a sub-space. False where
  // that is left to the calling thread.
  bool add(std::size_t i, dxGeom* geom, Slot slot, bool alone, Share& share) {
    const dParallelSAPProbe& probe = request.probes[i];
    if (probe.ignore && geom->body == probe.ignore) return true;
    if (way.filter.isSet() && !IS_SPACE(geom)) {
      const ScopedMode programs(programs_mode);
      if (way.filter.rejects(request.first + i, geom)) return true;
    }
    if (hasAABBTest(geom) || hasAABBTest(probe.geom)) {
      if (!alone) return false;
      const ScopedMode programs(programs_mode);
      if (!passesAABBTests(geom, probe.geom)) return true;
    }
    if (!IS_SPACE(geom)) {
      share.pairs.push_back({probe.geom, geom});
      share.slots.push_back(slot);
      return true;
    }
    bool all = true;
    if (const NestedTree* const own = nestedAt(nested, slot))
      return addNested(i, *own, alone, share);
    for (dxGeom* own = static_cast<dxSpace*>(geom)->first; own && all; own = own->next)
      if (boxesOverlap(own, probe.geom) && isEnabled(own) && filtersMatch(own, probe.geom))
        all = add(i, own, slot, alone, share);
    return all;
  }

  __attribute__((noinline)) bool addNested(std::size_t i, const NestedTree& own, bool alone,
                                           Share& share) {
    bool all = true;
    findHits(&own.tree, own.geoms, request.probes[i].geom, PackRules(), share.nested);
    for (std::size_t hit = 0; hit < share.nested.hits.size() && all; ++hit)
      all = add(i, share.nested.hits[hit], own.slot, alone, share);
    return all;
  }

  // Whether one of the share's pairs from the first on touches: then none is left, else those that
  // this thread may not collide.
  bool collideAny(std::size_t first, bool alone, Share& share) {
    std::size_t left = first;
    share.contacts.resizeDiscarding(static_cast<std::size_t>(request.flags & 0xffff));
    for (std::size_t i = first; i < share.pairs.size(); ++i) {
      const dParallelSAPPair pair = share.pairs[i];
      const ColliderUse use = alone ? ColliderUse::Light : colliderUse(pair.o1, pair.o2);
      if (use == ColliderUse::OwnCollider || use == ColliderUse::CallingThread) {
        share.pairs[left] = pair;
        share.slots[left++] = share.slots[i];
      } else if (collideInTurn(pair.o1, pair.o2, request.flags, share.contacts.data(),
                               sizeof(dContactGeom))) {
        return share.resize(first), true;
      }
    }
    return share.resize(left), false;
  }

  // The shares in the order of the probes.
  void listAll() {
    std::size_t count = 0;
    for (const Share& share : lists.shares) count += share.pairs.size();
    lists.all.resize(count);
    dParallelSAPPair* pair = lists.all.pairs.data();
    Slot* slot = lists.all.slots.data();
    for (const Block& block : lists.blocks) {
      const Share& share = lists.shares[static_cast<std::size_t>(block.thread)];
      for (std::size_t i = block.first; i < block.first + block.count; ++i) {
        *pair++ = share.pairs[i];
        *slot++ = share.slots[i];
      }
    }
  }
};

// Needs no pass: a callback may leave it by longjmp.
std::size_t report(const Scene& scene, const OverlapRequest& request, const OverlapLists& lists) {
  std::size_t all = 0, place = 0;
  for (std::size_t i = 0; i < request.count; ++i) {
    std::size_t& touched = request.probes[i].touched;
    for (std::size_t left = lists.blocks[i].count; left > 0; --left)
      touched += lists.narrow_phase.contactsOf(place++).count > 0;
    if (request.any) touched = touched > 0;
    all += touched;
  }
  if (!request.callback) return all;
  const Reports::Open open(scene.reports);
  place = 0;
  for (std::size_t i = 0; i < request.count; ++i)
    for (std::size_t left = lists.blocks[i].count; left > 0; --left, ++place) {
      const NarrowPhase::Contacts contacts = lists.narrow_phase.contactsOf(place);
      dxGeom* const geom = lists.all.pairs[place].o2;
      if (contacts.count && (!scene.reports.changed() ||
                             scene.reports.holds(scene.slots, lists.all.slots[place], geom)))
        request.callback(request.data, request.first + i, geom, contacts.data,
                         static_cast<int>(contacts.count));
    }
  return all;
}

}  // namespace

std::size_t findOverlaps(const Scene& scene, GeomTree& tree, const PackRules& rules,
                         const OverlapRequest& request, const BatchWay& way, OverlapLists& lists,
                         NestedTrees nested) {
  const auto find = [&](const GeomTree* by, const OverlapRequest& probes, int threads) {
    Pass{scene, rules, probes, way, threads, lists, by, nested}.run();
  };
  return runBatch(scene, tree, request, way, lists, nested, find,
                  [&](const OverlapRequest& probes) { return report(scene, probes, lists); });
}

}  // namespace ode_parallel_sap
