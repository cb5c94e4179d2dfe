#include "space/contacts/narrow_phase.h"

#include <algorithm>
#include <new>

#include "space/contacts/collider_threads.h"
#include "space/contacts/thread_colliders.h"
#include "space/contacts/thread_data.h"
#include "space/contacts/tuning.h"
#include "space/contacts/written_numbers.h"
#include "space/data/parallel.h"
#include "space/data/tuning.h"
#include "space/geom/geom_prefetch.h"
#include "space/geom/ode_private.h"

namespace ode_parallel_sap {

namespace {

// The bits of dCollide's flags that are the most contacts, as ODE documents them.
constexpr int most_contacts_mask = 0xffff;

// fixed: pairs whose results, 8 KB, are still in the nearest cache when they are read again.
constexpr std::size_t report_block = 512;

Region colliding("contacts: pairs"), colliding_heavy("contacts: heavy pairs"),
    colliding_on_images("contacts: pairs on images");

// As many as are tested at a time, but few enough that nobody waits long for the last thread.
std::size_t chunkFor(std::size_t pairs, int team) {
  if (team == 1) return most_apart_pairs;
  return std::clamp<std::size_t>(pairs / (tasks_a_thread * static_cast<std::size_t>(team)), 1,
                                 most_apart_pairs);
}

// The pose, and the beginning of the body, which callbacks ask whether it is awake.
void prefetchPlace(const dxGeom* geom) {
  prefetchPose(geom);
  if (geom->body) prefetchObject(geom->body, 128);
}

// The collider of two convexes that an ODE without libccd has leaves the sides of its contacts as
// the caller had them: none, not those of another pair.
void clearSides(const dParallelSAPPair& pair, dContactGeom* contacts, int count) {
  if (pair.o1->type != dConvexClass || pair.o2->type != dConvexClass) return;
  for (int i = 0; i < count; ++i) contacts[i].side1 = contacts[i].side2 = -1;
}

// Appends the contacts of a pair, by the program's ODE or an image of it, and returns how many they
// are.
std::uint32_t collide(const dParallelSAPPair& pair, int flags, const ContactRequest& request,
                      Buffer<dContactGeom>& contacts, ThreadCollider* image = nullptr) {
  const std::size_t size = contacts.size();
  contacts.resize(size + (flags & most_contacts_mask));
  dContactGeom* const found = contacts.data() + size;
  const int of_ode = flags & ~dParallelSAPOnCallingThread;
  constexpr int skip = sizeof(dContactGeom);
  clearSides(pair, found, flags & most_contacts_mask);
  int count = image ? image->collide(pair.o1, pair.o2, of_ode, found, skip)
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

bool asksForContacts(int flags) {
  return (flags & most_contacts_mask) != 0;
}

// With CONTACTS_UNIMPORTANT ODE's collider of boxes decides otherwise; a pair for the calling
// thread may have a collider of the program's.
bool mayLeaveOut(int flags) {
  return asksForContacts(flags) &&
         !(flags & (static_cast<int>(CONTACTS_UNIMPORTANT) | dParallelSAPOnCallingThread));
}

// The first ones: few pairs have many more, and what lies behind them the processor asks for
// itself.
void prefetchContacts(const dContactGeom* contacts) {
  constexpr std::size_t first = 3;  // fixed: pairs that touch have two on average
  prefetchObject(contacts, first * sizeof *contacts);
}

}  // namespace

class NarrowPhase::Pass {
 public:
  Pass(NarrowPhase& phase, const Buffer<dParallelSAPPair>& pairs, const ContactRequest& request,
       const Way& way)
      : phase_(phase), pairs_(pairs), request_(request), way_(way) {}

  std::size_t size() const { return pairs_.size(); }

  // Calls work(range, thread) for all of [0, count) by a team, and returns the team's size.
  template <class Work>
  int share(Region& region, std::size_t count, std::size_t chunk, int threads, Work work) const {
    // Contacts that are told are of classes whose colliders need no data of ODE's.
    return way_.tells ? runParts(region, threads, count, chunk, work)
                      : runPartsWithData(region, threads, count, chunk, way_.manual_cleanup, work);
  }

  // Asks for what comes after the i-th of `count` pairs; pairOf(i) tells where in the list it is.
  template <class PairOf>
  void prefetchAfter(std::size_t i, std::size_t count, PairOf pairOf) const {
    if (i + 2 * pairs_ahead >= count) return;
    const dParallelSAPPair &later = pairs_[pairOf(i + 2 * pairs_ahead)],
                           &next = pairs_[pairOf(i + pairs_ahead)];
    prefetchGeom(later.o1);
    prefetchGeom(later.o2);
    prefetchPlace(next.o1);
    prefetchPlace(next.o2);
  }

  // Looks at a chunk of pairs: first for their flags, then which are apart, then at the others.
  void lookAt(Range range, int thread, bool alone) const {
    if (range.begin / most_apart_pairs % way_.one_in != 0) {
      leaveOut(range);
      return;
    }
    int flags[most_apart_pairs];
    std::uint32_t wanted = 0, testable = 0;
    for (std::size_t i = 0; i < range.end - range.begin; ++i) {
      prefetchAfter(range.begin + i, pairs_.size(), [](std::size_t pair) { return pair; });
      flags[i] = request_.flagsOf(pairs_[range.begin + i]);
      Found& found = phase_.found_[range.begin + i];
      found = {0, 0, asksForContacts(flags[i]) ? std::uint16_t{0} : nobody, 0};
      if (way_.tells && asksForContacts(flags[i])) found.bodies = bodiesOf(pairs_[range.begin + i]);
      wanted |= std::uint32_t{asksForContacts(flags[i])} << i;
      testable |= std::uint32_t{mayLeaveOut(flags[i])} << i;
    }
    if (way_.leave_out) wanted &= ~findApart(range, wanted & testable, thread);
    for (; wanted; wanted &= wanted - 1) {
      const int i = __builtin_ctz(wanted);
      handOut({range.begin + i, flags[i]}, thread, alone);
    }
  }

  void leaveOut(Range range) const {
    for (std::size_t i = range.begin; i < range.end; ++i) phase_.found_[i] = {0, 0, nobody, 0};
  }

  std::uint32_t findApart(Range range, std::uint32_t wanted, int thread) const {
    const ApartBoxes found =
        certainlyApart(pairs_.data() + range.begin, range.end - range.begin, wanted);
    LeftOut& left_out = phase_.shares_[thread].left_out;
    left_out.tested += static_cast<std::size_t>(__builtin_popcount(found.tested));
    left_out.apart += static_cast<std::size_t>(__builtin_popcount(found.apart));
    return found.apart;
  }

  // A thread that is alone need not tell the pairs apart: this is the serial loop.
  void handOut(const Waiting& waiting, int thread, bool alone) const {
    if (alone) {
      collide(waiting, thread);
      return;
    }
    const dParallelSAPPair& pair = pairs_[waiting.pair];
    const ColliderUse use = waiting.flags & dParallelSAPOnCallingThread
                                ? ColliderUse::CallingThread
                                : colliderUse(pair.o1, pair.o2);
    Share& share = phase_.shares_[thread];
    switch (use) {
      case ColliderUse::Light:
        collide(waiting, thread);
        break;
      case ColliderUse::Heavy:
        share.heavy.push_back(waiting);
        break;
      case ColliderUse::Image:
        share.image.push_back(waiting);
        break;
      case ColliderUse::CallingThread:
        share.calling_thread.push_back(waiting);
        break;
    }
  }

  void collide(const Waiting& waiting, int thread, ThreadCollider* image = nullptr) const {
    Buffer<dContactGeom>& contacts = phase_.shares_[thread].contacts;
    Found& found = phase_.found_[waiting.pair];
    found.first = contacts.size();
    found.thread = static_cast<std::uint16_t>(thread);
    if (way_.tells) markNext(contacts, waiting.flags);
    found.count =
        ode_parallel_sap::collide(pairs_[waiting.pair], waiting.flags, request_, contacts, image);
    if (way_.tells && found.count > most_precomputed_contacts) found.thread = nobody;
  }

  // Room for the contacts of a pair, as far as they may be told.
  static void markNext(Buffer<dContactGeom>& contacts, int flags) {
    const std::size_t size = contacts.size();
    const int most = std::min<int>(flags & most_contacts_mask, most_precomputed_contacts);
    contacts.resize(size + static_cast<std::size_t>(flags & most_contacts_mask));  // as collide()
    markUnwritten(contacts.data() + size, static_cast<std::size_t>(most));
    contacts.resize(size);
  }

  // Where pairs are told one by one, the program collides this one when it asks for it.
  void collideLast(const Waiting& waiting) const {
    if (way_.tells)
      phase_.found_[waiting.pair].thread = nobody;
    else
      collide(waiting, 0);
  }

  // Leaves it to the calling thread where the image does not serve it.
  void collideOn(ThreadCollider& image, const Waiting& waiting, int thread) const {
    const dParallelSAPPair& pair = pairs_[waiting.pair];
    if (image.serves(pair.o1, pair.o2))
      collide(waiting, thread, &image);
    else
      phase_.shares_[thread].calling_thread.push_back(waiting);
  }

 private:
  NarrowPhase& phase_;
  const Buffer<dParallelSAPPair>& pairs_;
  const ContactRequest& request_;
  const Way& way_;
};

int NarrowPhase::run(const Buffer<dParallelSAPPair>& pairs, const ContactRequest& request,
                     const Way& way) {
  const int threads = way.threads;
  if (shares_.size() < static_cast<std::size_t>(threads)) shares_.resize(threads);
  for (Share& share : shares_) share.clear();
  found_.resizeDiscarding(pairs.size());
  const Pass pass(*this, pairs, request, way);
  int used = lookAtAll(pass, threads);
  used = std::max(used, collideHeavy(pass, threads));
  used = std::max(used, collideOnImages(pass, threads));
  collideRest(pass);
  return used;
}

int NarrowPhase::lookAtAll(const Pass& pass, int threads) {
  const bool alone = threads == 1;
  const int team = teamFor(pass.size(), grains::collided_pairs, threads);
  const std::size_t chunk = chunkFor(pass.size(), team);
  return pass.share(colliding, pass.size(), chunk, team,
                    [&, alone](Range range, int thread) { pass.lookAt(range, thread, alone); });
}

int NarrowPhase::collideHeavy(const Pass& pass, int threads) {
  gather(shares_, &Share::heavy, waiting_);
  if (waiting_.size() == 0) return 1;
  const int team = teamFor(waiting_.size(), grains::heavy_pairs, threads);
  return pass.share(colliding_heavy, waiting_.size(), 1, team, [&](Range range, int thread) {
    for (std::size_t i = range.begin; i < range.end; ++i) pass.collide(waiting_[i], thread);
  });
}

int NarrowPhase::collideOnImages(const Pass& pass, int threads) {
  gather(shares_, &Share::image, waiting_);
  const ThreadColliders images(teamFor(waiting_.size(), grains::heavy_pairs, threads),
                               waiting_.size());
  if (images.count() == 0) {
    for (const Waiting& waiting : waiting_) shares_[0].calling_thread.push_back(waiting);
    return 1;
  }
  // Of pairs of meshes one may take a hundred times as long as another.
  const std::size_t chunk = chunkFor(waiting_.size() / tasks_a_thread, images.count());
  return pass.share(
      colliding_on_images, waiting_.size(), chunk, images.count(), [&](Range range, int thread) {
        for (std::size_t i = range.begin; i < range.end; ++i) {
          pass.prefetchAfter(i, waiting_.size(), [&](std::size_t at) { return waiting_[at].pair; });
          pass.collideOn(images[thread], waiting_[i], thread);
        }
      });
}

void NarrowPhase::collideRest(const Pass& pass) {
  gather(shares_, &Share::calling_thread, waiting_);
  std::sort(waiting_.begin(), waiting_.end(),
            [](const Waiting& a, const Waiting& b) { return a.pair < b.pair; });
  for (const Waiting& waiting : waiting_) pass.collideLast(waiting);
}

void NarrowPhase::report(const Buffer<dParallelSAPPair>& pairs,
                         const ContactRequest& request) const {
  for (std::size_t begin = 0; begin < pairs.size(); begin += report_block)
    reportBlock({begin, std::min(begin + report_block, pairs.size())}, pairs, request);
}

// Most pairs touch nothing, in no order that a processor could foresee: those that touch are picked
// first, without a branch.
void NarrowPhase::reportBlock(Range block, const Buffer<dParallelSAPPair>& pairs,
                              const ContactRequest& request) const {
  std::uint16_t touching[report_block];
  std::size_t count = 0;
  for (std::size_t pair = block.begin; pair < block.end; ++pair) {
    touching[count] = static_cast<std::uint16_t>(pair - block.begin);
    count += found_[pair].count != 0;
  }
  const auto foundOf = [&](std::size_t i) -> const Found& {
    return found_[block.begin + touching[i]];
  };
  const auto contactsOf = [&](const Found& found) {
    return shares_[found.thread].contacts.data() + found.first;
  };
  constexpr std::size_t ahead = 4 * pairs_ahead;
  for (std::size_t i = 0; i < std::min(count, ahead); ++i) prefetchContacts(contactsOf(foundOf(i)));
  for (std::size_t i = 0; i < count; ++i) {
    if (i + ahead < count) prefetchContacts(contactsOf(foundOf(i + ahead)));
    const Found& found = foundOf(i);
    request.report(pairs[block.begin + touching[i]], contactsOf(found), found.count);
  }
}

void NarrowPhase::collideOneByOne(const Buffer<dParallelSAPPair>& pairs,
                                  const ContactRequest& request) {
  Buffer<dContactGeom> contacts;
  for (const dParallelSAPPair& pair : pairs) {
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

void NarrowPhase::precomputeNothing() {
  found_.resizeDiscarding(0);
  for (Share& share : shares_) share.contacts.resizeDiscarding(0);
}

std::size_t NarrowPhase::precomputed() const {
  return static_cast<std::size_t>(std::count_if(
      found_.begin(), found_.end(), [](const Found& found) { return found.thread != nobody; }));
}

// ODE takes the quaternion of a body as it is, and makes a geom's own from its matrix. It takes a
// body from a geom without a trace, as that stays where it is.
std::uint16_t NarrowPhase::bodiesOf(const dParallelSAPPair& pair) {
  return static_cast<std::uint16_t>((pair.o1->body ? 1 : 0) | (pair.o2->body ? 2 : 0) |
                                    (pair.o1->offset_posr ? 4 : 0) |
                                    (pair.o2->offset_posr ? 8 : 0));
}

int NarrowPhase::tell(std::size_t place, const dParallelSAPPair& pair, dContactGeom* contacts,
                      int skip) const {
  const Found& found = found_[place];
  if (found.thread == nobody || found.bodies != bodiesOf(pair)) return -1;
  const dContactGeom* const told = shares_[found.thread].contacts.data() + found.first;
  for (std::uint32_t i = 0; i < found.count; ++i)
    copyWritten(told[i], *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(contacts) +
                                                          static_cast<std::ptrdiff_t>(i) * skip));
  return static_cast<int>(found.count);
}

std::size_t NarrowPhase::contacts() const {
  std::size_t contacts = 0;
  for (const Share& share : shares_) contacts += share.contacts.size();
  return contacts;
}

NarrowPhase::LeftOut NarrowPhase::leftOut() const {
  LeftOut all = {};
  for (const Share& share : shares_) {
    all.tested += share.left_out.tested;
    all.apart += share.left_out.apart;
  }
  return all;
}

}  // namespace ode_parallel_sap
