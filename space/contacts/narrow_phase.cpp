#include "space/contacts/narrow_phase.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "space/base/tuning.h"
#include "space/contacts/contact_pairs.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

namespace {

// The bits of dCollide's flags that are the most contacts, as ODE documents them.
constexpr int most_contacts_mask = 0xffff;

Region colliding("contacts: pairs"), colliding_heavy("contacts: heavy pairs"),
    colliding_on_images("contacts: pairs on images");

// Few enough that nobody waits long for the last thread. A round number.
std::size_t chunkFor(std::size_t pairs, int team) {
  return std::min<std::size_t>(taskSize(pairs, team), 32);
}

// Appends the contacts of a pair, by the program's ODE or its own collider. Returns their number.
std::uint32_t appendContacts(const dParallelSAPPair& pair, int flags, const ContactRequest& request,
                             Buffer<dContactGeom>& contacts, ThreadCollider* own = nullptr) {
  const std::size_t size = contacts.size();
  const int most = flags & most_contacts_mask;
  contacts.resize(size + most);
  dContactGeom* const found = contacts.data() + size;
  const int of_ode = flags & ~dParallelSAPOnCallingThread;
  constexpr int skip = sizeof(dContactGeom);
  // The collider of two convexes that an ODE without libccd has leaves the sides of its contacts as
  // the caller had them: none, not those of another pair.
  if (pair.o1->type == dConvexClass && pair.o2->type == dConvexClass)
    for (int i = 0; i < most; ++i) found[i].side1 = found[i].side2 = -1;
  if (request.prepare) request.prepare(found, most);
  int count = own ? own->collide(pair.o1, pair.o2, of_ode, found, skip)
                  : collideInTurn(pair.o1, pair.o2, of_ode, found, skip);
  if (count && request.callbacks.reduce) {
    const int kept = request.callbacks.reduce(request.data, pair.o1, pair.o2, found, count);
    require(kept >= 0 && kept <= count, "a reduce callback keeps 0 to all contacts of a pair",
            "dParallelSAPSpaceCollideContacts");
    count = std::clamp(kept, 0, count);
  }
  contacts.resize(size + count);
  return static_cast<std::uint32_t>(count);
}

// Prefetches what a collider reads of a pair that comes soon, and of one that comes later: geoms
// lie scattered in memory, and what other threads wrote is in their caches.
constexpr std::size_t pairs_ahead = 4;  // fixed: so many pairs ahead, or twice

void prefetchPairs(const dParallelSAPPair& soon, const dParallelSAPPair& later) {
  // The derived classes' sizes follow the base: one line more holds most of them.
  prefetchObject(later.o1, sizeof(dxGeom) + 32);
  prefetchObject(later.o2, sizeof(dxGeom) + 32);
  for (const dxGeom* const geom : {soon.o1, soon.o2}) {
    prefetchPose(geom);
    if (geom->body) prefetchObject(geom->body, 128);  // callbacks ask whether it is awake
  }
}

}  // namespace

bool isFinite(const dContactGeom& contact) {
  const auto finite = [](dReal number) { return std::isfinite(number); };
  return finite(contact.depth) && std::all_of(contact.normal, contact.normal + 3, finite) &&
         std::all_of(contact.pos, contact.pos + 3, finite);
}

int NarrowPhase::run(const Buffer<dParallelSAPPair>& pairs, const ContactRequest& request,
                     int threads, bool manual_cleanup, const Touch* touches) {
  const Job job = {pairs, request, threads, touches};
  if (shares_.size() < static_cast<std::size_t>(threads)) shares_.resize(threads);
  for (Share& share : shares_) {
    share.contacts.resizeDiscarding(0);
    share.changed.resizeDiscarding(0);
    for (Buffer<Waiting>* const waiting :
         {&share.heavy, &share.own_collider, &share.calling_thread})
      waiting->resizeDiscarding(0);
  }
  found_.resizeDiscarding(pairs.size());

  int used = 1;
  const auto share = [&](Region& region, std::size_t count, std::size_t chunk, int team,
                         auto work) {
    used = std::max(used, runPartsWithData(region, team, count, chunk, manual_cleanup, work));
  };
  const int team = teamFor(pairs.size(), grains::collided_pairs, threads);
  share(colliding, pairs.size(), chunkFor(pairs.size(), team), team, [&](Range range, int thread) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      if (i + 2 * pairs_ahead < pairs.size())
        prefetchPairs(pairs[i + pairs_ahead], pairs[i + 2 * pairs_ahead]);
      found_[i] = {0, 0, 0};
      const int flags = request.flagsOf(pairs[i], i);
      if (flags & most_contacts_mask)
        collideOrQueue(job, {i, flags}, thread);
      else
        noteTouch(job, i, false, thread);
    }
  });

  gather(shares_, &Share::heavy, waiting_);
  if (waiting_.size())
    share(colliding_heavy, waiting_.size(), 1,
          teamFor(waiting_.size(), grains::heavy_pairs, threads), [&](Range range, int thread) {
            for (std::size_t i = range.begin; i < range.end; ++i) collide(job, waiting_[i], thread);
          });

  gather(shares_, &Share::own_collider, waiting_);
  const ThreadColliders own(teamFor(waiting_.size(), grains::heavy_pairs, threads),
                            waiting_.size());
  const auto collideOnOwn = [&](Range range, int thread) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Waiting& waiting = waiting_[i];
      const dParallelSAPPair& pair = pairs[waiting.pair];
      if (i + 2 * pairs_ahead < waiting_.size())
        prefetchPairs(pairs[waiting_[i + pairs_ahead].pair],
                      pairs[waiting_[i + 2 * pairs_ahead].pair]);
      if (own[thread].serves(pair.o1, pair.o2))
        collide(job, waiting, thread, &own[thread]);
      else
        shares_[thread].calling_thread.push_back(waiting);
    }
  };
  // Of pairs of meshes one may take a hundred times as long as another.
  if (own.count())
    share(colliding_on_images, waiting_.size(),
          chunkFor(waiting_.size() / tasks_a_thread, own.count()), own.count(), collideOnOwn);
  else
    for (const Waiting& waiting : waiting_) shares_[0].calling_thread.push_back(waiting);

  gather(shares_, &Share::calling_thread, waiting_);
  std::sort(waiting_.begin(), waiting_.end(),
            [](const Waiting& a, const Waiting& b) { return a.pair < b.pair; });
  for (const Waiting& waiting : waiting_) collide(job, waiting, 0);
  gather(shares_, &Share::changed, changed_);
  if (!std::is_sorted(changed_.begin(), changed_.end()))
    std::sort(changed_.begin(), changed_.end());
  return used;
}

// Puts pairs into the queues of later passes. One thread needs none: this is the serial loop.
void NarrowPhase::collideOrQueue(const Job& job, const Waiting& waiting, int thread) {
  if (job.threads == 1) return collide(job, waiting, thread);
  const dParallelSAPPair& pair = job.pairs[waiting.pair];
  const ColliderUse use = waiting.flags & dParallelSAPOnCallingThread
                              ? ColliderUse::CallingThread
                              : colliderUse(pair.o1, pair.o2);
  switch (use) {
    case ColliderUse::Light:
      return collide(job, waiting, thread);
    case ColliderUse::Heavy:
      return shares_[thread].heavy.push_back(waiting);
    case ColliderUse::OwnCollider:
      return shares_[thread].own_collider.push_back(waiting);
    case ColliderUse::CallingThread:
      return shares_[thread].calling_thread.push_back(waiting);
  }
}

void NarrowPhase::collide(const Job& job, const Waiting& waiting, int thread, ThreadCollider* own) {
  Buffer<dContactGeom>& contacts = shares_[thread].contacts;
  Found& found = found_[waiting.pair];
  found.first = contacts.size();
  found.thread = static_cast<std::uint32_t>(thread);
  found.count = appendContacts(job.pairs[waiting.pair], waiting.flags, job.request, contacts, own);
  noteTouch(job, waiting.pair, found.count != 0, thread);
}

// Contacts that other threads wrote are in their caches. The first ones are asked for: few pairs
// have many more, and the processor prefetches what lies behind them itself.
void NarrowPhase::report(ContactPairs& all, const ContactRequest& request) {
  constexpr std::size_t ahead = 8 * pairs_ahead;
  constexpr std::size_t first = 3;  // fixed: pairs that touch have two on average
  const Reports::Open open(all.scene().reports);
  const Buffer<dParallelSAPPair>& pairs = all.list();
  for (std::size_t pair = 0; pair < pairs.size(); ++pair) {
    if (pair + ahead < pairs.size() && found_[pair + ahead].count)
      prefetchObject(contactsOf(pair + ahead).data, first * sizeof(dContactGeom));
    if (!found_[pair].count || !all.stays(pair)) continue;
    const dContactGeom* const contacts = contactsOf(pair).data;
    if (!told_of_nan_ && !std::all_of(contacts, contacts + found_[pair].count, isFinite)) {
      told_of_nan_ = true;
      dMessage(0,
               "parallel SAP space: dCollide of geoms %p and %p, or the reduce callback, gave a "
               "contact that is not finite, which no joint can use",
               static_cast<const void*>(pairs[pair].o1), static_cast<const void*>(pairs[pair].o2));
      if (!all.stays(pair)) continue;
    }
    request.report(pairs[pair], contacts, found_[pair].count);
  }
}

void NarrowPhase::collideOneByOne(ContactPairs& pairs, const ContactRequest& request) {
  for (std::size_t place = 0; place < pairs.list().size(); ++place)
    if (pairs.stays(place)) collideOne(pairs.list()[place], request, pairs.scene());
}

void NarrowPhase::collideOne(const dParallelSAPPair& pair, const ContactRequest& request,
                             const Scene& scene) {
  const int flags = request.flagsOf(pair);
  if (!(flags & most_contacts_mask)) return;
  Buffer<dContactGeom> contacts;
  try {
    contacts.reserve(static_cast<std::size_t>(flags & most_contacts_mask));
  } catch (const std::bad_alloc&) {
    dDebug(0, "parallel SAP space: no memory for the contacts of one pair");
  }
  const Reports::Open open(scene.reports);
  if (const std::uint32_t found = appendContacts(pair, flags, request, contacts))
    request.report(pair, contacts.data(), found);
}

std::size_t NarrowPhase::contacts() const {
  std::size_t contacts = 0;
  for (const Share& share : shares_) contacts += share.contacts.size();
  return contacts;
}

}  // namespace ode_parallel_sap
