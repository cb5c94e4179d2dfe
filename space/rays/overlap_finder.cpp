#include "space/rays/overlap_finder.h"

#include <atomic>
#include <thread>

#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

Region finding("overlaps: probes");

using Share = OverlapLists::Share;

constexpr int nobody = -1;  // no thread

struct Pass : BatchPass<OverlapRequest, OverlapLists> {
  std::atomic<bool> updating[64] = {};  // by geom; fixed: seldom one for two of them

  void run() {
    if (team() > 1) prepareThoseInSpaces();
    findAll(finding, [this](std::size_t i, int thread, bool alone) { find(i, thread, alone); });
    for (std::size_t i = 0; i < request.count; ++i)
      if (lists.blocks[i].thread == nobody) find(i, 0, /*alone=*/true);
    listAll();
    const ContactRequest contacts = {nullptr, request.flags, {}};
    lists.narrow_phase.run(lists.pairs, contacts, way.threads, way.manual_cleanup);
  }

  void prefetchLater(std::size_t i) const {
    if (i + prefetch_distance < request.count)
      prefetchObject(request.probe(i + prefetch_distance).geom, sizeof(dxGeom));
  }

  // Another thread may be bringing the geoms of such a space up to date. The calling thread waits
  // for that, and no other.
  void prepareThoseInSpaces() const {
    for (std::size_t i = 0; i < request.count; ++i) {
      prefetchLater(i);
      dxGeom* const geom = request.probe(i).geom;
      if (geom && geom->parent_space) request.prepare(geom);
    }
  }

  void find(std::size_t i, int thread, bool alone) {
    dParallelSAPProbe& probe = request.probe(i);
    prefetchLater(i);
    Share& share = lists.shares[thread];
    BatchBlock& block = lists.blocks[i] = {share.found.size(), 0, thread};
    probe.touched = 0;
    if (alone)
      request.prepare(probe.geom);
    else if (!update(probe.geom))
      block.thread = nobody;
    if (block.thread == nobody || hasNaN(probe.geom)) return;
    {
      const ScopedMode exact(exactMode());
      findHits(tree, scene.slots, probe.geom, way.rules, share.query);
      for (dxGeom* const geom : share.query.hits)
        if (!add(i, geom, Slots::slotOf(geom), alone, share)) block.thread = nobody;
    }
    if (block.thread == nobody) return share.found.resize(block.first);
    if (request.any) probe.touched = collideAny(block.first, alone, share);
    block.count = static_cast<std::uint32_t>(share.found.size() - block.first);
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
    const dParallelSAPProbe& probe = request.probe(i);
    if (probe.ignore && geom->body == probe.ignore) return true;
    if (!IS_SPACE(geom) && rejects(i, geom)) return true;
    if (hasAABBTest(geom) || hasAABBTest(probe.geom)) {
      if (!alone) return false;
      const ScopedMode programs(mode);
      if (!passesAABBTests(geom, probe.geom)) return true;
    }
    if (!IS_SPACE(geom)) {
      share.found.push_back({{probe.geom, geom}, slot});
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
    findHits(&own.tree, own.geoms, request.probe(i).geom, PairRules(), share.nested);
    for (std::size_t hit = 0; hit < share.nested.hits.size() && all; ++hit)
      all = add(i, share.nested.hits[hit], own.slot, alone, share);
    return all;
  }

  // Whether one of the share's pairs from the first on touches: then none is left, else those that
  // this thread may not collide.
  bool collideAny(std::size_t first, bool alone, Share& share) {
    std::size_t left = first;
    share.contacts.resizeDiscarding(static_cast<std::size_t>(request.flags & 0xffff));
    for (std::size_t i = first; i < share.found.size(); ++i) {
      const dParallelSAPPair& pair = share.found[i].pair;
      const ColliderUse use = alone ? ColliderUse::Light : colliderUse(pair.o1, pair.o2);
      if (use == ColliderUse::OwnCollider || use == ColliderUse::CallingThread) {
        share.found[left++] = share.found[i];
      } else if (collideInTurn(pair.o1, pair.o2, request.flags, share.contacts.data(),
                               sizeof(dContactGeom))) {
        return share.found.resize(first), true;
      }
    }
    return share.found.resize(left), false;
  }

  // The shares' pairs in the order of the probes.
  void listAll() {
    std::size_t count = 0;
    for (const Share& share : lists.shares) count += share.found.size();
    lists.pairs.resizeDiscarding(count);
    dParallelSAPPair* next = lists.pairs.data();
    for (const BatchBlock& block : lists.blocks)
      for (std::uint32_t i = 0; i < block.count; ++i)
        *next++ = lists.shares[block.thread].found[block.first + i].pair;
  }

  // Needs no pass: a callback may leave it by longjmp.
  static std::size_t report(const Scene& scene, const OverlapRequest& request,
                            const OverlapLists& lists) {
    std::size_t all = 0, place = 0;
    for (std::size_t i = 0; i < request.count; ++i) {
      std::size_t& touched = request.probe(i).touched;
      for (std::size_t left = lists.blocks[i].count; left > 0; --left)
        touched += lists.narrow_phase.contactsOf(place++).count > 0;
      if (request.any) touched = touched > 0;
      all += touched;
    }
    if (!request.callback) return all;
    const Reports::Open open(scene.reports);
    place = 0;
    for (std::size_t i = 0; i < request.count; ++i) {
      const BatchBlock& block = lists.blocks[i];
      for (std::uint32_t at = 0; at < block.count; ++at, ++place) {
        const NarrowPhase::Contacts contacts = lists.narrow_phase.contactsOf(place);
        const auto& [pair, slot] = lists.shares[block.thread].found[block.first + at];
        if (contacts.count &&
            (!scene.reports.changed() || scene.reports.holds(scene.slots, slot, pair.o2)))
          request.callback(request.data, request.first + i, pair.o2, contacts.data,
                           static_cast<int>(contacts.count));
      }
    }
    return all;
  }
};

}  // namespace

std::size_t findOverlaps(const Scene& scene, GeomTree& tree, const OverlapRequest& request,
                         const BatchWay& way, OverlapLists& lists, NestedTrees nested) {
  return runBatch<Pass>(scene, tree, request, way, lists, std::move(nested));
}

}  // namespace ode_parallel_sap
