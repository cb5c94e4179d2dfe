// The narrow phase: its pairs compared with the oracle, its contacts with a loop over dCollide.
#include <array>
#include <atomic>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "driver.h"

namespace sap_test {
namespace {

struct Stop : std::runtime_error {
  Stop() : std::runtime_error("stop") {}
};

enum class Interruption { none, collides, throws, flags_throw };

// The data of all callbacks: what they are to do, and what they saw.
struct Call {
  std::size_t salt = 0;
  bool reduces = false;
  bool descends = false;  // into spaces, which are passed over otherwise
  bool inside = false;    // collides them, too
  Interruption interruption = Interruption::none;
  std::size_t at = 0;
  std::function<void()> collide_within = {};

  std::mutex lock = {};
  Pairs pairs = {};        // asked for their flags, in any order
  Pairs with_spaces = {};  // in the order of the calls
  Contacts contacts = {};
  std::size_t reports = 0;
  const std::thread::id caller = std::this_thread::get_id();
  bool elsewhere = false;             // a callback that belongs to the caller's thread
  std::atomic<bool> needless{false};  // a pair without contacts was reduced

  std::size_t decide(dGeomID o1, dGeomID o2) const {
    return 7 * number(o1) + 11 * number(o2) + salt;
  }
  void mustBeCaller() { elsewhere = elsewhere || std::this_thread::get_id() != caller; }
};

int flagsOf(void* data, dGeomID o1, dGeomID o2) {
  if (!isTame(o1) || !isTame(o2)) return 0;
  const std::size_t way = static_cast<const Call*>(data)->decide(o1, o2);
  int flags = static_cast<int>(way % 5 * 3);
  if (way % 3 == 0) flags |= static_cast<int>(CONTACTS_UNIMPORTANT);
  if (way % 7 == 0) flags |= dParallelSAPOnCallingThread;
  return flags;
}

int flagsOfNext(void* data, dGeomID o1, dGeomID o2) {
  Call& call = *static_cast<Call*>(data);
  {
    const std::lock_guard<std::mutex> guard(call.lock);
    record(&call.pairs, o1, o2);
    if (call.interruption == Interruption::flags_throw && call.pairs.size() == call.at)
      throw Stop();
  }
  return flagsOf(data, o1, o2);
}

int reduceAny(void* data, dGeomID o1, dGeomID o2, dContactGeom* contacts, int count) {
  Call& call = *static_cast<Call*>(data);
  const std::size_t way = call.decide(o1, o2);
  if (count == 0) call.needless = true;
  if (way % 2) std::reverse(contacts, contacts + count);
  return static_cast<int>(way % static_cast<std::size_t>(count + 1));
}

void replaceSpaces(void* data, dGeomID o1, dGeomID o2, void* pairs) {
  Call& call = *static_cast<Call*>(data);
  call.mustBeCaller();
  record(&call.with_spaces, o1, o2);
  if (call.descends) dSpaceCollide2(o1, o2, pairs, dParallelSAPAddPair);
  for (const dGeomID geom : {o1, o2})
    if (call.inside && dGeomIsSpace(geom))
      dSpaceCollide(reinterpret_cast<dSpaceID>(geom), pairs, dParallelSAPAddPair);
}

void report(void* data, dGeomID o1, dGeomID o2, const dContactGeom* contacts, int count) {
  Call& call = *static_cast<Call*>(data);
  call.mustBeCaller();
  if (++call.reports == call.at && call.interruption == Interruption::collides)
    call.collide_within();
  recordContacts(&call.contacts, o1, o2, contacts, count);
  if (call.reports == call.at && call.interruption == Interruption::throws) throw Stop();
}

// Returns whether it came to its end.
bool collideContacts(dSpaceID space, Call& call) try {
  dParallelSAPContactCallbacks callbacks = {report, flagsOfNext, nullptr, replaceSpaces};
  if (call.reduces) callbacks.reduce = reduceAny;
  dParallelSAPSpaceCollideContacts(space, &call, 0, &callbacks);
  return true;
} catch (const Stop&) {
  return false;
}

// Everything but what is done within. `other` is to be such a call that nothing interrupts.
void decide(Decisions& decisions, Call& call, Call& other) {
  call.salt = other.salt = decisions.below(256);
  call.reduces = other.reduces = call.salt % 2;
  call.descends = other.descends = call.salt % 8 < 6;
  call.inside = other.inside = call.salt % 16 < 4;
  if (decisions.chance(96)) call.interruption = static_cast<Interruption>(decisions.below(4));
  call.at = 1 + decisions.below(call.interruption == Interruption::flags_throw ? 600 : 100);
}

// What is wrong about a call that came to its end or not; "" if nothing is.
std::string problemOf(const Call& call, bool finished, Contacts expected) {
  if (call.elsewhere) return "a callback ran in another thread";
  if (call.needless) return "a pair without contacts was reduced";
  if (!finished) {
    const bool by_flags = call.interruption == Interruption::flags_throw;
    if (by_flags && !call.contacts.empty()) return "contacts reported after a callback threw";
    expected.resize(std::min(expected.size(), call.contacts.size()));
  }
  return difference(call.contacts, expected);
}

}  // namespace

bool isTame(dGeomID geom, bool for_rays) {
  const int shape = dGeomGetClass(geom);
  if (!for_rays && (shape == dCylinderClass || shape == dTriMeshClass)) return false;
  if (shape == dPlaneClass) return true;
  if (shape == dCapsuleClass) {
    dReal radius, length;
    dGeomCapsuleGetParams(geom, &radius, &length);
    if (radius < dReal(1e-6)) return false;
  }
  // Two spaces hand over geoms of no size, as in ODE, whose collider of boxes ends the program.
  dVector3 sides;
  if (shape == dBoxClass) {
    dGeomBoxGetLengths(geom, sides);
    if (std::find(sides, sides + 3, dReal(0)) != sides + 3) return false;
  }
  const dReal* const at = dGeomGetPosition(geom);
  return std::all_of(at, at + 3, [](dReal x) { return std::fabs(x) < dReal(1e7); });
}

// What the space itself found of a call's pairs, in the order that is owed.
Pairs Driver::ownPairs(int space, const Pairs& pairs, const Pairs& with_spaces) const {
  std::vector<std::size_t> places(objects_.size());
  const std::vector<int>& members = objects_[space].members;
  for (std::size_t i = 0; i < members.size(); ++i) places[members[i]] = i;
  Pairs own;
  for (const Pairs* list : {&pairs, &with_spaces}) {
    for (const Pair& pair : *list) {
      if (objects_[pair.first].parent == space && objects_[pair.second].parent == space)
        own.push_back(pair);
    }
  }
  std::sort(own.begin(), own.end(), [&places](const Pair& a, const Pair& b) {
    return std::make_pair(places[a.first], places[a.second]) <
           std::make_pair(places[b.first], places[b.second]);
  });
  return own;
}

// What a loop over these pairs of a space finds.
Contacts Driver::expectedContacts(const Pairs& pairs, const SerialLoop& how, bool descends) const {
  SerialLoop loop = how;
  for (const Pair& pair : pairs) {
    const Object &a = objects_[pair.first], &b = objects_[pair.second];
    if (descends || (a.kind != kSpace && b.kind != kSpace)) {
      SerialLoop::collide(&loop, a.geom, b.geom);
    }
  }
  return loop.contacts;
}

void Driver::collideContacts() {
  const int space = pickOurSpace();
  const dSpaceID id = spaceOf(space);
  const int usual_threads = dParallelSAPSpaceGetNumThreads(id);
  const int threads[] = {1, 2, 3, 7, usual_threads};
  const int some_threads = threads[decisions_.below(std::size(threads))];
  Call call, inner;
  decide(decisions_, call, inner);
  Pairs inner_pairs;
  call.collide_within = [&] {
    inner_pairs = collide(id);
    sap_test::collideContacts(id, inner);
  };
  SerialLoop loop;
  loop.flags_of = flagsOf;
  loop.reduce = call.reduces ? reduceAny : nullptr;
  loop.data = &call;
  loop.inside = call.inside;
  log("contacts of " + std::to_string(space) + " by " + std::to_string(some_threads) +
      " threads, salt " + std::to_string(call.salt) + ", interruption " +
      std::to_string(static_cast<int>(call.interruption)) + " at " + std::to_string(call.at));

  bool finished;
  Pairs own;
  Contacts expected;
  {
    const FloatingPointMode scoped(mode());
    dParallelSAPSpaceSetNumThreads(id, some_threads);
    finished = sap_test::collideContacts(id, call);
    dParallelSAPSpaceSetNumThreads(id, usual_threads);
    // Where its callback threw it did not ask for all flags.
    const bool asked = finished || call.interruption != Interruption::flags_throw;
    own = asked ? ownPairs(space, call.pairs, call.with_spaces) : collide(id);
    expected = expectedContacts(own, loop, call.descends);
  }
  compare(space, own, false);
  std::string problem = problemOf(call, finished, expected);
  if (problem.empty() && !inner_pairs.empty()) {
    compare(space, inner_pairs, false);
    // Two frames may find different pairs beyond those owed.
    if (dParallelSAPSpaceGetTolerance(spaceOf(space)) == 0)
      problem = problemOf(inner, true, expected);
  }
  if (!problem.empty()) fail("contacts of space " + std::to_string(space) + ": " + problem);
}

// A frame whose touches are followed. Callbacks may collide within it, or throw.
void Driver::collideTouching(int space, EventsOracle& oracle, Random& random) {
  const dSpaceID id = spaceOf(space);
  const int threads[] = {1, 3, 7};
  dParallelSAPSpaceSetNumThreads(id, threads[random.below(std::size(threads))]);
  Call call, inner;
  // Mostly the same pairs touch.
  call.salt = random.chance(0.8) ? 9 : random.below(256);
  inner.salt = call.salt + 1;
  call.reduces = random.chance(0.5);
  call.descends = random.chance(0.9);
  // Each pair of a sub-space collides this, too: few geoms have many contacts.
  const std::vector<int> all = within(space);
  const std::size_t members = objects_[space].members.size(), deeper = all.size() - members;
  const bool is_flat = std::none_of(all.begin(), all.end(), [&](int object) {
    return objects_[object].kind == kSpace && objects_[object].parent != space;
  });
  call.inside = call.descends && is_flat && members * deeper * deeper < 5000 && random.chance(0.5);
  if (random.chance(0.3)) call.interruption = static_cast<Interruption>(random.below(4));
  call.at = 1 + random.below(20);
  const auto events = [id] {
    return std::array<Events, 4>{begunTouchesOf(id), endedTouchesOf(id), begunOf(id), endedOf(id)};
  };
  call.collide_within = [&] {
    const auto before = events();
    const int skips = dParallelSAPSpaceGetSkipStatic(id);
    dParallelSAPSpaceSetSkipStatic(id, !skips);  // so that other pairs are found
    (void)collide(id);
    sap_test::collideContacts(id, inner);
    dParallelSAPSpaceSetSkipStatic(id, skips);
    if (events() != before) fail("events of a collide within");
  };
  const bool within_tolerance = dParallelSAPSpaceGetTolerance(id) > 0;
  const bool may_throw = call.interruption == Interruption::flags_throw;
  if (may_throw && within_tolerance) call.interruption = Interruption::none;
  Pairs own;
  if (may_throw) checkEvents(space, own = collide(id), oracle);
  const bool finished = sap_test::collideContacts(id, call);
  const bool is_lost = !finished && call.interruption == Interruption::flags_throw;
  if (!is_lost) own = ownPairs(space, call.pairs, call.with_spaces);
  compare(space, own);
  checkEvents(space, own, oracle);
  if (is_lost) {
    if (!begunTouchesOf(id).empty() || !endedTouchesOf(id).empty())
      fail("touches though flags were not known");
    return;
  }
  SerialLoop loop;
  loop.flags_of = flagsOf;
  loop.reduce = call.reduces ? reduceAny : nullptr;
  loop.data = &call;
  loop.inside = call.inside;
  const Contacts expected = expectedContacts(own, loop, call.descends);
  std::string problem = problemOf(call, finished, expected);
  Pairs touches;
  for (const Contact& contact : expected)
    if (const Pair touch(objects_[number(contact.o1)].stay, objects_[number(contact.o2)].stay);
        touches.empty() || touches.back() != touch)
      touches.push_back(touch);
  EventsOracle::Geoms geoms, within;
  addGeoms(space, false, geoms);
  addGeoms(space, true, within);
  if (problem.empty()) problem = oracle.checkTouches(id, touches, geoms, within);
  if (!problem.empty()) fail("touches of space " + std::to_string(space) + ": " + problem);
  touches_ += touches.size();
}

}  // namespace sap_test
