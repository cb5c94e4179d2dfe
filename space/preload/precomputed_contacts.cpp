#include "space/preload/precomputed_contacts.h"

#include <algorithm>
#include <cstring>
#include <new>

#include "space/base/platform.h"
#include "space/contacts/contact_pairs.h"
#include "space/frame/reports.h"

namespace ode_parallel_sap {

namespace {

constexpr int needs_update = GEOM_DIRTY | GEOM_POSR_BAD;
// fixed: a pair with more contacts is not answered, since room for so many is marked for every
// pair. Boxes have eight, few others more.
constexpr std::uint32_t most_contacts = 16;

// ODE's colliders leave the fourth number of a contact's position or normal as the caller had it,
// or write it, as it comes. Contacts that are copied to the caller must do the same. So those
// numbers are made signalling NaNs first, which no arithmetic returns.
constexpr BoundBits unwritten =
    static_cast<BoundBits>(sizeof(dReal) == sizeof(double) ? 0x7ff4a5c35a3ca5c3 : 0x7fa5a5c3);

void copyWritten(const dReal* from, dReal* to) {
  const bool fourth = std::memcmp(&from[3], &unwritten, sizeof unwritten) != 0;
  std::memcpy(to, from, (fourth ? 4 : 3) * sizeof *to);
}

void copyWritten(const dContactGeom& from, dContactGeom& to) {
  copyWritten(from.pos, to.pos);
  copyWritten(from.normal, to.normal);
  to.depth = from.depth;
  to.g1 = from.g1;
  to.g2 = from.g2;
  to.side1 = from.side1;
  to.side2 = from.side2;
}

}  // namespace

// If there is one: a callback that was left by longjmp has left its report standing.
void PrecomputedContacts::endReport() {
  reporting_ = false;
  PrecomputedContacts** report = &reporting_now_;
  while (*report && *report != this) report = &(*report)->outer_;
  if (*report) *report = outer_;
}

// One thread gains nothing.
bool PrecomputedContacts::prepare(Frame& frame, const PairList& pairs) try {
  const int most = teamFor(pairs.size(), grains::collided_pairs, frame.plan.most_threads);
  if (!always_) {
    if (most == 1 || back_off_.skipTurn()) return false;
    // More than one thread's part of the pairs: contacts are stored and copied, and threads
    // started.
    constexpr double margin = 0.25;  // fixed: that costs a fifth of a collision (callgrind)
    least_share_ = 1.0 / most + margin;
  }
  // By what the program did in the last report.
  bool any = false;
  habits_.resize(kinds);
  for (Habit& habit : habits_) {
    if (habit.pairs) habit.flags = habit.isWorth(least_share_) ? habit.asked : 0;
    habit.pairs = habit.votes = 0;
    any = any || habit.flags != 0;
  }
  next_place_ = next_answer_ = 0;
  geoms_ = {};
  changed_.clear();
  changed_all_ = false;
  mode_ = currentMode();
  last_ = {};
  list_.resizeDiscarding(0);
  // Where modes cannot be compared nothing would be answered.
  if (any && !stopped_.load(std::memory_order_relaxed) && !differs(mode_, mode_))
    collide(frame, pairs);
  return true;
} catch (const std::bad_alloc&) {
  release();
  return true;
}

void PrecomputedContacts::release() {
  list_ = Buffer<dParallelSAPPair>();
  kinds_ = Buffer<Kind>();
  narrow_phase_ = NarrowPhase();
}

void PrecomputedContacts::collide(Frame& frame, const PairList& pairs) {
  const int threads = frame.plan.most_threads;
  list_.resizeDiscarding(pairs.size());
  resolve(pairs, {0, pairs.size()}, frame.call.geoms(), threads, list_.data());
  kinds_.resizeDiscarding(list_.size());
  ContactRequest request = {this, 0, {}};
  // On any thread. With 0 the pair is not collided.
  request.flags_at = [](void* self, std::size_t place, const dParallelSAPPair& pair) {
    PrecomputedContacts& own = *static_cast<PrecomputedContacts*>(self);
    const Kind kind = kindOf(pair.o1, pair.o2);
    const int flags = kind == kinds ? 0 : own.habits_[kind].flags;
    own.kinds_[place] = flags ? kind : kinds;
    return flags;
  };
  request.prepare = [](dContactGeom* contacts, int count) {
    for (int i = 0; i < std::min<int>(count, most_contacts); ++i)
      for (dReal* const fourth : {&contacts[i].pos[3], &contacts[i].normal[3]})
        std::memcpy(fourth, &unwritten, sizeof unwritten);
  };
  const int used = narrow_phase_.run(list_, request, threads, frame.call.manual_cleanup);
  frame.stats.contacts = narrow_phase_.contacts();
  last_.precomputed =
      list_.size() - static_cast<std::size_t>(std::count(kinds_.begin(), kinds_.end(), kinds));
  if (last_.precomputed) frame.stats.narrow_threads = used;
}

// The kind of a pair is its two classes and which of its geoms have bodies; it is `kinds` if the
// pair may not be precomputed. Programs treat kinds differently: many do not collide two geoms
// without bodies, or ask for fewer contacts of a sphere. ODE also takes the quaternion of a body as
// it is, and makes a geom's own from its matrix; and it takes a body from a geom without a trace,
// as that stays where it is.
//
// Spheres, boxes, capsules and cylinders: all that dCollide reads of them lies in the geoms and
// their bodies, and whoever changes it makes the geom dirty. (Vertices, heights and the flags of
// rays change without a trace, other classes are the program's.) Not planes: handing out the
// contacts of a pair takes some 300 instructions and ODE's colliders with a plane 50 to 300
// (callgrind). Geoms of one body are not collided while they are that.
PrecomputedContacts::Kind PrecomputedContacts::kindOf(const dxGeom* o1, const dxGeom* o2) {
  constexpr int classes = dCylinderClass + 1;
  static_assert(dSphereClass == 0 && classes == 4, "spheres to cylinders come first");
  static_assert(kinds == classes * classes * 4, "with or without two bodies");
  const auto isKnown = [](const dxGeom* geom) {
    return geom && geom->type >= 0 && geom->type < classes;
  };
  if (!isKnown(o1) || !isKnown(o2) || (o1->body && o1->body == o2->body)) return kinds;
  const int bodies = (o1->body ? 1 : 0) + (o2->body ? 2 : 0);
  return static_cast<Kind>((o1->type * classes + o2->type) * 4 + bodies);
}

void PrecomputedContacts::report(const Frame& frame, const PairList& pairs, void* data,
                                 dNearCallback* callback) {
  struct End {
    PrecomputedContacts& contacts;
    ~End() {
      contacts.endReport();
      contacts.learn();
    }
  };
  endReport();
  outer_ = reporting_now_;
  reporting_ = true;
  reporting_now_ = this;  // from now on dCollide on this thread is answered, or watched
  const End end{*this};
  const Reports::Open open(frame.call.scene.reports);
  const auto call = [&](Pair pair, std::size_t place, dxGeom* a, dxGeom* b) {
    pair_ = pair;
    geoms_ = {a, b};
    next_place_ = place + 1;
    const std::size_t later = place + prefetch_distance;
    if (later < list_.size() && narrow_phase_.touches(later))
      prefetch(narrow_phase_.contactsOf(later).data);
    const std::size_t kind = anyChanged() ? kinds : kindOf(a, b);
    if (kind < habits_.size()) ++habits_[kind].pairs;
    callback(data, a, b);
  };
  reportPairs(pairs, frame.call.scene, frame.call.lists.large->limit, call);
}

void PrecomputedContacts::learn() {
  all_.add(last_);
  if (always_) return;
  const bool enough =
      static_cast<double>(last_.used) >= least_share_ * static_cast<double>(last_.precomputed);
  const auto isWorth = [this](const Habit& habit) { return habit.isWorth(least_share_); };
  if (!enough || std::none_of(habits_.begin(), habits_.end(), isWorth)) {
    back_off_.failed();
    habits_.clear();
  } else if (last_.precomputed) {
    back_off_.paid();
  }
}

void PrecomputedContacts::noteChange(Slot slot) try {
  if (reporting_ && !changed_all_) changed_.insert(slot);
} catch (const std::bad_alloc&) {
  changed_all_ = true;
}

// Once something has changed, of the pair that is reported only: whose slots are known.
bool PrecomputedContacts::isUnchanged(std::size_t place) const {
  if (!anyChanged()) return true;
  return !changed_all_ && place + 1 == next_place_ && !changed_.count(earlierOf(pair_)) &&
         !changed_.count(laterOf(pair_));
}

// Some programs gather a few pairs before they collide them.
std::size_t PrecomputedContacts::placeBehind(const dxGeom* o1, const dxGeom* o2) const {
  constexpr std::size_t places = 8;  // fixed: some may have been left out, and looking is cheap
  const std::size_t end = std::min(next_answer_ + places, list_.size());
  for (std::size_t place = next_answer_; place < end; ++place)
    if (list_[place].o1 == o1 && list_[place].o2 == o2) return place;
  return list_.size();
}

// Most programs collide the pair that is reported.
int PrecomputedContacts::answerOwn(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts,
                                   int skip) {
  const Kind kind = kindOf(o1, o2);
  if (kind >= habits_.size()) return -1;
  // With CONTACTS_UNIMPORTANT some of ODE's colliders fail: nobody is to call one in vain.
  if (flags == (flags & 0xffff)) habits_[kind].vote(flags);
  if (habits_[kind].flags != flags || flags == 0) return -1;
  const bool reported = o1 == geoms_.o1 && o2 == geoms_.o2;
  const std::size_t place = reported ? next_place_ - 1 : placeBehind(o1, o2);
  if (place >= list_.size() || !isUnchanged(place)) return -1;
  if (skip < static_cast<int>(sizeof(dContactGeom)) || !contacts) return -1;
  if ((o1->gflags | o2->gflags) & needs_update) return -1;
  if (differs(mode_, currentMode()) || stopped_.load(std::memory_order_relaxed)) return -1;
  if (kinds_[place] != kind) return -1;
  const NarrowPhase::Contacts found = narrow_phase_.contactsOf(place);
  if (found.count > most_contacts) return -1;
  for (std::size_t i = 0; i < found.count; ++i)
    copyWritten(found.data[i],
                *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(contacts) +
                                                 static_cast<std::ptrdiff_t>(i) * skip));
  if (place >= next_answer_) {
    ++last_.used;
    last_.contacts += found.count;
    next_answer_ = place + 1;
  }
  return static_cast<int>(found.count);
}

int PrecomputedContacts::answer(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts,
                                int skip) {
  return reporting_now_ ? reporting_now_->answerOwn(o1, o2, flags, contacts, skip) : -1;
}

}  // namespace ode_parallel_sap
