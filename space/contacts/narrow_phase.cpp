#include "space/contacts/narrow_phase.h"

#include <algorithm>
#include <new>

#include "space/contacts/collider_threads.h"
#include "space/contacts/tuning.h"
#include "space/data/parallel.h"
#include "space/data/tuning.h"
#include "space/geom/ode_private.h"

namespace ode_parallel_sap {

namespace {

// The bits of dCollide's flags that are the most contacts, as ODE documents them.
constexpr int most_contacts_mask = 0xffff;

Region colliding("contacts: pairs"), colliding_heavy("contacts: heavy pairs");

std::size_t chunkFor(std::size_t pairs, int team) {
  return std::clamp<std::size_t>(pairs / (tasks_a_thread * static_cast<std::size_t>(team)), 1,
                                 most_pairs_a_chunk);
}

// All lines of an object, which need not begin with one.
void prefetchObject(const void* object, std::size_t size) {
  const char* const bytes = static_cast<const char*>(object);
  for (std::size_t line = 0; line < size; line += 64) __builtin_prefetch(bytes + line);
  __builtin_prefetch(bytes + size - 1);
}

// The derived classes' sizes follow the base: one line more holds most of them.
void prefetchGeom(const dxGeom* geom) {
  prefetchObject(geom, sizeof(dxGeom) + 32);
}

// The pose, and the beginning of the body, which callbacks ask whether it is awake.
void prefetchPose(const dxGeom* geom) {
  if (geom->final_posr) prefetchObject(geom->final_posr, sizeof(dxPosR));
  if (geom->body) prefetchObject(geom->body, 128);
}

// ODE's data for a thread of the team, the calling thread apart: that one's is its own business.
// Without manual cleanup ODE frees it when the thread ends or ODE is closed.
class ThreadData {
 public:
  ThreadData(int thread, bool manual_cleanup) : release_(thread != 0 && manual_cleanup) {
    ready_ = thread == 0 || dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
  }
  ~ThreadData() {
    if (release_) dCleanupODEAllDataForThread();
  }
  ThreadData(const ThreadData&) = delete;
  ThreadData& operator=(const ThreadData&) = delete;

  // Where there is no memory for it the others do this thread's work.
  bool ready() const { return ready_; }

 private:
  const bool release_;
  bool ready_;
};

// Appends the contacts of a pair and returns how many they are.
std::uint32_t collide(const GeomPair& pair, int flags, const ContactRequest& request,
                      Buffer<dContactGeom>& contacts) {
  const std::size_t size = contacts.size();
  contacts.resize(size + (flags & most_contacts_mask));
  dContactGeom* const found = contacts.data() + size;
  int count =
      dCollide(pair.o1, pair.o2, flags & ~dParallelSAPOnCallingThread, found, sizeof(dContactGeom));
  if (count && request.callbacks.reduce) {
    const int kept = request.callbacks.reduce(request.data, pair.o1, pair.o2, found, count);
    dUASSERT(kept >= 0 && kept <= count, "a reduce callback keeps 0 to all contacts of a pair");
    count = std::clamp(kept, 0, count);
  }
  contacts.resize(size + count);
  return static_cast<std::uint32_t>(count);
}

bool asksForContacts(int flags) {
  return (flags & most_contacts_mask) != 0;
}

void prefetchContacts(const dContactGeom* contacts, std::size_t count) {
  constexpr std::size_t most = 8;  // fixed: few pairs have more
  prefetchObject(contacts, std::min(count, most) * sizeof *contacts);
}

}  // namespace

class NarrowPhase::Pass {
 public:
  Pass(NarrowPhase& phase, const Buffer<GeomPair>& pairs, const ContactRequest& request,
       bool manual_cleanup)
      : phase_(phase), pairs_(pairs), request_(request), manual_cleanup_(manual_cleanup) {}

  std::size_t size() const { return pairs_.size(); }

  // Calls work(index, thread) for all of [0, count) by a team, and returns the team's size.
  template <class Work>
  int share(Region& region, std::size_t count, std::size_t chunk, int threads, Work work) const {
    ChunkQueue queue(count, chunk);
    int used = 1;
    runTeam(region, threads, [&](int thread, int team) {
      if (thread == 0) used = team;
      const ThreadData data(thread, manual_cleanup_);
      if (!data.ready()) return;
      Range range;
      while (queue.next(range))
        for (std::size_t i = range.begin; i < range.end; ++i) work(i, thread);
    });
    return used;
  }

  void prefetchAfter(std::size_t pair) const {
    if (pair + 2 * pairs_ahead < pairs_.size()) {
      prefetchGeom(pairs_[pair + 2 * pairs_ahead].o1);
      prefetchGeom(pairs_[pair + 2 * pairs_ahead].o2);
      prefetchPose(pairs_[pair + pairs_ahead].o1);
      prefetchPose(pairs_[pair + pairs_ahead].o2);
    }
  }

  void lookAt(std::size_t pair, int thread, bool alone) const {
    prefetchAfter(pair);
    phase_.found_[pair].count = 0;
    const int flags = request_.flagsOf(pairs_[pair]);
    if (!asksForContacts(flags)) return;
    if (alone) {
      collide({pair, flags}, thread);
      return;
    }
    const ColliderUse use = flags & dParallelSAPOnCallingThread
                                ? ColliderUse::CallingThread
                                : colliderUse(pairs_[pair].o1, pairs_[pair].o2);
    Share& share = phase_.shares_[thread];
    switch (use) {
      case ColliderUse::Light:
        collide({pair, flags}, thread);
        break;
      case ColliderUse::Heavy:
        share.heavy.push_back({pair, flags});
        break;
      case ColliderUse::CallingThread:
        share.calling_thread.push_back({pair, flags});
        break;
    }
  }

  void collide(const Waiting& waiting, int thread) const {
    Buffer<dContactGeom>& contacts = phase_.shares_[thread].contacts;
    Found& found = phase_.found_[waiting.pair];
    found.first = contacts.size();
    found.thread = static_cast<std::uint32_t>(thread);
    found.count =
        ode_parallel_sap::collide(pairs_[waiting.pair], waiting.flags, request_, contacts);
  }

 private:
  NarrowPhase& phase_;
  const Buffer<GeomPair>& pairs_;
  const ContactRequest& request_;
  const bool manual_cleanup_;
};

int NarrowPhase::run(const Buffer<GeomPair>& pairs, const ContactRequest& request, int threads,
                     bool manual_cleanup) {
  if (shares_.size() < static_cast<std::size_t>(threads)) shares_.resize(threads);
  for (Share& share : shares_) {
    share.contacts.resizeDiscarding(0);
    share.heavy.resizeDiscarding(0);
    share.calling_thread.resizeDiscarding(0);
  }
  found_.resizeDiscarding(pairs.size());
  const Pass pass(*this, pairs, request, manual_cleanup);
  int used = lookAtAll(pass, threads);
  used = std::max(used, collideHeavy(pass, threads));
  collideRest(pass);
  return used;
}

// A thread that is alone need not tell the pairs apart: this is the serial loop.
int NarrowPhase::lookAtAll(const Pass& pass, int threads) {
  const bool alone = threads == 1;
  const int team = teamFor(pass.size(), grains::collided_pairs, threads);
  const std::size_t chunk = chunkFor(pass.size(), team);
  return pass.share(colliding, pass.size(), chunk, team,
                    [&, alone](std::size_t pair, int thread) { pass.lookAt(pair, thread, alone); });
}

int NarrowPhase::collideHeavy(const Pass& pass, int threads) {
  waiting_.resizeDiscarding(0);
  for (const Share& share : shares_)
    for (const Waiting& waiting : share.heavy) waiting_.push_back(waiting);
  if (waiting_.size() == 0) return 1;
  const int team = teamFor(waiting_.size(), grains::heavy_pairs, threads);
  return pass.share(colliding_heavy, waiting_.size(), 1, team,
                    [&](std::size_t i, int thread) { pass.collide(waiting_[i], thread); });
}

void NarrowPhase::collideRest(const Pass& pass) {
  waiting_.resizeDiscarding(0);
  for (const Share& share : shares_)
    for (const Waiting& waiting : share.calling_thread) waiting_.push_back(waiting);
  std::sort(waiting_.begin(), waiting_.end(),
            [](const Waiting& a, const Waiting& b) { return a.pair < b.pair; });
  for (const Waiting& waiting : waiting_) pass.collide(waiting, 0);
}

void NarrowPhase::report(const Buffer<GeomPair>& pairs, const ContactRequest& request) const {
  const auto contactsOf = [&](const Found& found) {
    return shares_[found.thread].contacts.data() + found.first;
  };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i + 4 * pairs_ahead < pairs.size() && found_[i + 4 * pairs_ahead].count)
      prefetchContacts(contactsOf(found_[i + 4 * pairs_ahead]), found_[i + 4 * pairs_ahead].count);
    const Found& found = found_[i];
    if (found.count) request.report(pairs[i], contactsOf(found), found.count);
  }
}

void NarrowPhase::collideOneByOne(const Buffer<GeomPair>& pairs, const ContactRequest& request) {
  Buffer<dContactGeom> contacts;
  for (const GeomPair& pair : pairs) {
    const int flags = request.flagsOf(pair);
    if (!asksForContacts(flags)) continue;
    contacts.resizeDiscarding(0);
    try {
      contacts.reserve(static_cast<std::size_t>(flags & most_contacts_mask));
    } catch (const std::bad_alloc&) {
      dDebug(0, "parallel SAP space: no memory for the contacts of one pair");
    }
    if (const std::uint32_t count = collide(pair, flags, request, contacts))
      request.report(pair, contacts.data(), count);
  }
}

std::size_t NarrowPhase::contacts() const {
  std::size_t contacts = 0;
  for (const Share& share : shares_) contacts += share.contacts.size();
  return contacts;
}

std::size_t NarrowPhase::bytes() const {
  std::size_t bytes = found_.bytes() + waiting_.bytes();
  for (const Share& share : shares_)
    bytes += share.contacts.bytes() + share.heavy.bytes() + share.calling_thread.bytes();
  return bytes;
}

}  // namespace ode_parallel_sap
