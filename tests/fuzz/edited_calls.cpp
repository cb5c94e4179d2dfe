#include "edited_calls.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <map>
#include <memory>
#include <vector>

#include "../support/events_oracle.h"
#include "../support/oracle.h"
#include "../support/recorder.h"
#include "../support/user_box.h"

namespace sap_test {
namespace {

enum Way { kNear, kBlocks, kContacts, kQuery, kOwnQuery, kRays, kOverlaps, kWays };

constexpr int kNone = -1;
constexpr int kDeepest = 3;  // levels of calls within calls
constexpr std::size_t kRayCount = 12, kProbeCount = 4;

bool odeAsserts() {
  return dCheckConfiguration("ODE_EXT_no_debug") == 0;
}

struct Stop {
  int levels;  // that it is to leave
};

// The place of an object is its number; no two ever have one.
struct Object {
  dGeomID geom;  // null: destroyed
  int parent = kNone;
  bool is_space = false, ours = false, placeable = true;
  std::vector<int> members = {};                         // in the order of adding
  std::vector<std::pair<unsigned long, int>> left = {};  // when, and which space
};

// What is owed: two geoms, or a ray or probe and a geom.
struct Owed {
  std::size_t first, second;
  // Both, or the one, with the spaces around them up to that of the call.
  std::vector<std::vector<int>> chains = {};
  bool reported = false;
  bool may_miss = false;
};

// A call that runs.
struct Level {
  std::jmp_buf back;
  Way way;
  int space, own_probe;
  unsigned long begin;
  std::vector<Owed> owed;
  std::map<Pair, std::size_t> places;  // in `owed`
  std::size_t next = 0;
  bool tells;    // touches, which were not looked at yet
  double share;  // how often it changes something
};

class EditedCalls {
 public:
  EditedCalls(Random& random, const Configuration* configuration, std::size_t geoms, bool jumps)
      : random_(random), jumps_(jumps), side_(0.8 * std::cbrt(static_cast<double>(geoms))) {
    self_ = this;
    addSpace(dParallelSAPSpaceCreate(nullptr), true, kNone);
    if (configuration) configure(idOf(0), *configuration);
    dParallelSAPSpaceSetNumThreads(idOf(0), random_.chance(0.5) ? 1 : 3);
    dParallelSAPSpaceSetEvents(idOf(0), static_cast<int>(random_.below(4)));
    dParallelSAPSpaceSetSweptBounds(idOf(0), random_.chance(0.3) ? dReal(0.01) : 0);
    for (int i = 0; i < 5; ++i)
      if (random_.chance(0.6)) createSpace();
    for (std::size_t i = 0; i < geoms; ++i) createLeaf(true);
    if (random_.chance(0.5)) {
      note(dCreatePlane(idOf(0), 0, 0, 1, 1), 0);
      objects_.back().placeable = false;
    }
    for (std::size_t i = 0; i < kProbeCount; ++i)
      probes_.push_back(dCreateSphere(nullptr, dReal(i == 0 ? 2 * side_ : 0.8)));
    for (std::size_t i = 0; i < kRayCount; ++i) rays_.push_back(dCreateRay(nullptr, 1));
  }
  ~EditedCalls() {
    for (const dGeomID geom : probes_) dGeomDestroy(geom);
    for (const dGeomID geom : rays_) dGeomDestroy(geom);
    for (const Object& each : objects_)
      if (each.geom && !each.is_space && each.parent == kNone) dGeomDestroy(each.geom);
    for (const Object& each : objects_)
      if (each.geom && each.is_space && each.parent == kNone)
        dSpaceDestroy(reinterpret_cast<dSpaceID>(each.geom));
  }
  EditedCalls(const EditedCalls&) = delete;
  EditedCalls& operator=(const EditedCalls&) = delete;

  std::string play(int calls) {
    for (int i = 0; i < calls && problem_.empty(); ++i) {
      edit(kNone);
      touch();
      runBelow(4096 * at(calls - i));
    }
    return problem_;
  }
  bool jumped() const { return !locked_.empty(); }

 private:
  dSpaceID idOf(int space) const { return reinterpret_cast<dSpaceID>(objects_[at(space)].geom); }
  static std::size_t at(int object) { return static_cast<std::size_t>(object); }

  // --- The world ---

  int note(dGeomID geom, int parent) {
    const int object = static_cast<int>(objects_.size());
    setNumber(geom, objects_.size());
    objects_.push_back({geom, parent});
    if (parent != kNone) objects_[at(parent)].members.push_back(object);
    return object;
  }
  void addSpace(dSpaceID space, bool ours, int parent) {
    const int object = note(asGeom(space), parent);
    objects_[at(object)].is_space = true;
    objects_[at(object)].ours = ours;
    spaces_.push_back(object);
  }
  // Where ODE asserts, a locked space may only lose geoms that are destroyed.
  bool mayChange(int space) const { return space == kNone || !odeAsserts() || !isLocked(space); }
  bool isLocked(int space) const {
    for (int i = 0; i < depth_; ++i)
      if (levels_[i].space == space) return true;
    return std::find(locked_.begin(), locked_.end(), space) != locked_.end();
  }
  bool isWithin(int object, int space) const {
    for (; object != kNone; object = objects_[at(object)].parent)
      if (object == space) return true;
    return false;
  }
  bool holdsLocked(int space) const {
    return std::any_of(spaces_.begin(), spaces_.end(),
                       [&](int each) { return isLocked(each) && isWithin(each, space); });
  }
  int anySpace() { return spaces_[random_.below(spaces_.size())]; }
  int anyChangeable() {
    for (int i = 0; i < 5; ++i)
      if (const int space = anySpace(); mayChange(space)) return space;
    return kNone;
  }
  int anyLeaf() {
    for (int i = 0; i < 20; ++i) {
      const std::size_t object = random_.below(objects_.size());
      if (objects_[object].geom && !objects_[object].is_space) return static_cast<int>(object);
    }
    return kNone;
  }
  void place(int leaf) {
    const auto any = [&] { return static_cast<dReal>(random_.between(0, side_)); };
    if (objects_[at(leaf)].placeable)
      dGeomSetPosition(objects_[at(leaf)].geom, any(), any(), any());
  }
  // Moves nothing, but makes it dirty: stock spaces have trouble with clean geoms before dirty
  // ones.
  void markMoved(int object) {
    const Object& self = objects_[at(object)];
    if (self.is_space) return dGeomDestroy(dCreateSphere(reinterpret_cast<dSpaceID>(self.geom), 1));
    if (!self.placeable) return dGeomPlaneSetParams(self.geom, 0, 0, 1, 1);
    const dReal* const place = dGeomGetPosition(self.geom);
    dGeomSetPosition(self.geom, place[0], place[1], place[2]);
  }
  void touch() {
    const double share = random_.chance(0.3) ? 1 : random_.unit() * random_.unit();
    for (std::size_t i = 0; i < objects_.size(); ++i)
      if (objects_[i].geom && !objects_[i].is_space && random_.chance(share) &&
          mayChange(objects_[i].parent))
        markMoved(static_cast<int>(i));
  }

  void createSpace() {
    const int parent = random_.chance(0.5) && mayChange(0) ? 0 : anyChangeable();
    if (parent == kNone) return;
    dSpaceID (*const create[])(dSpaceID) = {dSimpleSpaceCreate, dHashSpaceCreate,
                                            dParallelSAPSpaceCreate, dParallelSAPSpaceCreate};
    const std::size_t kind = random_.below(4);
    addSpace(create[kind](idOf(parent)), kind > 1, parent);
  }
  void createLeaf(bool at_first = false) {
    const int parent = at_first && random_.chance(0.5) ? 0 : anyChangeable();
    if (parent == kNone) return;
    const dReal size = dReal(random_.between(0.3, 0.7));
    if (random_.chance(0.02)) {
      place(note(createUserBox(idOf(parent), {0, 1, 0, 1, 0, 1}, true), parent));
    } else {
      place(note(random_.chance(0.8) ? dCreateSphere(idOf(parent), size)
                                     : dCreateBox(idOf(parent), size, 1, size),
                 parent));
    }
  }
  void leave(int object) {
    Object& self = objects_[at(object)];
    if (self.parent == kNone) return;
    Object& parent = objects_[at(self.parent)];
    parent.members.erase(std::find(parent.members.begin(), parent.members.end(), object));
    self.left.emplace_back(++time_, self.parent);
    self.parent = kNone;
  }
  void forget(int object) {
    leave(object);
    Object& self = objects_[at(object)];
    self.geom = nullptr;
    if (!self.is_space) return;
    spaces_.erase(std::find(spaces_.begin(), spaces_.end(), object));
    const std::vector<int> members = self.members;
    for (const int member : members) forget(member);
  }
  void destroy(int object) {
    const dGeomID geom = objects_[at(object)].geom;
    forget(object);
    dGeomDestroy(geom);
  }
  bool remove(int object) {
    const int parent = objects_[at(object)].parent;
    if (parent == kNone) return true;
    if (!mayChange(parent)) return false;
    dSpaceRemove(idOf(parent), objects_[at(object)].geom);
    leave(object);
    return true;
  }
  void add(int object, int space) {
    if (space == kNone || isWithin(space, object)) return;
    ++time_;
    dSpaceAdd(idOf(space), objects_[at(object)].geom);
    objects_[at(object)].parent = space;
    objects_[at(space)].members.push_back(object);
    if (!objects_[at(space)].ours) markMoved(object);
  }

  // `reported`: of the geom that a callback has just got.
  void edit(int reported) {
    ++time_;
    const bool alive = reported != kNone && objects_[at(reported)].geom != nullptr;
    const int leaf = alive && random_.chance(0.5) ? reported : anyLeaf();
    const std::size_t what = random_.below(11);
    if (what == 0) return createLeaf();
    if (what == 1 && random_.chance(0.2) && spaces_.size() < 9) return createSpace();
    if (what == 2 && random_.chance(0.2)) return editSpace(anySpace());
    if (leaf == kNone || objects_[at(leaf)].is_space) return;
    const int parent = objects_[at(leaf)].parent;
    switch (what) {
      case 3:
      case 4:
        destroy(leaf);
        if (random_.chance(0.5)) createLeaf();  // often at the same address
        break;
      case 5:
      case 6:  // back at once, elsewhere, or nowhere
        if (remove(leaf)) add(leaf, what == 5 && mayChange(parent) ? parent : anyChangeable());
        break;
      case 7:  // by way of another space
        if (!remove(leaf)) break;
        add(leaf, anyChangeable());
        if (remove(leaf) && mayChange(parent)) add(leaf, parent);
        break;
      case 8:
        if (!dGeomIsEnabled(objects_[at(leaf)].geom))
          dGeomEnable(objects_[at(leaf)].geom);
        else if (random_.chance(0.3))
          dGeomDisable(objects_[at(leaf)].geom);
        break;
      default:
        if (mayChange(parent)) place(leaf);
    }
  }
  void editSpace(int space) {
    const int parent = objects_[at(space)].parent;
    if (space == 0 || holdsLocked(space)) return;
    if (random_.chance(0.2)) return destroy(space);
    if (remove(space))
      add(space, random_.chance(0.5) && mayChange(parent) ? parent : anyChangeable());
    if (objects_[at(space)].parent == kNone && mayChange(0)) add(space, 0);
  }

  // --- What is owed ---

  std::vector<int> chainOf(int object, int space) const {
    std::vector<int> chain;
    for (; object != kNone && object != space; object = objects_[at(object)].parent)
      chain.push_back(object);
    return chain;
  }
  void leavesOf(int object, std::vector<int>& leaves) const {
    const Object& self = objects_[at(object)];
    if (!self.is_space) leaves.push_back(object);
    for (const int member : self.members) leavesOf(member, leaves);
  }
  std::vector<int> leavesOf(int object) const {
    std::vector<int> leaves;
    leavesOf(object, leaves);
    return leaves;
  }
  static bool touches(dGeomID a, dGeomID b) {
    dContactGeom contact;
    return sap_test::overlap(boundsOf(a), boundsOf(b)) &&
           dCollide(a, b, 1, &contact, sizeof contact) > 0;
  }
  void owe(Level& level, std::size_t first, std::size_t second, bool both) {
    Owed owed = {first, second};
    owed.chains.push_back(chainOf(static_cast<int>(second), level.space));
    if (both) owed.chains.push_back(chainOf(static_cast<int>(first), level.space));
    const bool ordered = level.way != kContacts;
    level.places[ordered || first < second ? Pair(first, second) : Pair(second, first)] =
        level.owed.size();
    level.owed.push_back(std::move(owed));
  }
  void oweAll(Level& level) {
    const std::vector<int>& members = objects_[at(level.space)].members;
    std::vector<dGeomID> geoms;
    for (const int member : members) geoms.push_back(objects_[at(member)].geom);
    switch (level.way) {
      case kNear:
      case kBlocks:
        for (const Pair& pair : expectedPairs(geoms)) owe(level, pair.first, pair.second, true);
        break;
      case kContacts: {
        std::vector<std::vector<int>> leaves;
        for (const int member : members) leaves.push_back(leavesOf(member));
        for (std::size_t j = 1; j < members.size(); ++j)
          for (std::size_t i = 0; i < j; ++i)
            for (const int b : leaves[j])
              for (const int a : leaves[i]) oweContact(level, a, b, members[i], members[j]);
        break;
      }
      case kQuery:
      case kOwnQuery: {
        const bool own = level.own_probe != kNone;
        const dGeomID probe = own ? objects_[at(level.own_probe)].geom : probes_[0];
        const std::size_t first = own ? number(probe) : 0;
        for (const dGeomID geom : geoms)
          if (takesPart(geom) && mayTouch(geom, probe)) owe(level, first, number(geom), own);
        break;
      }
      case kRays:
        for (std::size_t i = 0; i < rays_.size(); ++i) oweTouching(level, i, rays_[i]);
        break;
      default:
        for (std::size_t i = 0; i < probes_.size(); ++i) oweTouching(level, i, probes_[i]);
    }
  }
  // Of two sub-spaces ODE walks one, disabled geoms and all.
  void oweContact(Level& level, int a, int b, int around_a, int around_b) {
    const dGeomID first = objects_[at(a)].geom, second = objects_[at(b)].geom;
    const bool on = dGeomIsEnabled(first) && dGeomIsEnabled(second);
    const bool walked = objects_[at(around_a)].is_space && objects_[at(around_b)].is_space;
    if ((!on && !walked) || !touches(first, second)) return;
    owe(level, at(a), at(b), true);
    level.owed.back().may_miss = !on;
  }
  void oweTouching(Level& level, std::size_t number, dGeomID probe) {
    for (const int leaf : leavesOf(level.space))
      if (dGeomIsEnabled(objects_[at(leaf)].geom) && touches(probe, objects_[at(leaf)].geom))
        owe(level, number, at(leaf), false);
  }

  enum Stay { kStays, kMayStay, kGone };
  // A space of ours knows for sure what left it. A stock space tells too little: what leaves it and
  // comes back may count as there all along.
  Stay stayOf(const std::vector<int>& chain, const Level& level) const {
    unsigned long first = ~0ul;  // when it did so first, alone or with the spaces around it
    bool is_sure = false;
    for (const int object : chain) {
      for (const auto& [time, space] : objects_[at(object)].left) {
        if (time <= level.begin || time >= first) continue;
        first = time;
        is_sure = objects_[at(space)].ours;
      }
    }
    if (first == ~0ul) return kStays;
    if (is_sure) return kGone;
    const std::vector<int> now = chainOf(chain.front(), level.space);
    const bool is_back = objects_[at(chain.front())].geom && now.back() == chain.back() &&
                         objects_[at(now.back())].parent == level.space;
    return is_back ? kMayStay : kGone;
  }
  Stay stayOf(const Owed& owed, const Level& level) const {
    Stay stay = kStays;
    for (const std::vector<int>& chain : owed.chains) stay = std::max(stay, stayOf(chain, level));
    return stay;
  }

  // --- The calls ---

  void fail(const std::string& what, const Level& level, std::size_t first, std::size_t second) {
    if (problem_.empty())
      problem_ = "way " + std::to_string(level.way) + " at depth " + std::to_string(depth_) +
                 " of space " + std::to_string(level.space) + ": " + what + " " +
                 std::to_string(first) + ", " + std::to_string(second);
  }
  void report(std::size_t first, std::size_t second, std::size_t place = ~std::size_t{0}) {
    Level& level = levels_[depth_ - 1];
    const bool ordered = level.way != kContacts;
    const auto found =
        level.places.find(ordered || first < second ? Pair(first, second) : Pair(second, first));
    if (found == level.places.end()) return fail("not owed:", level, first, second);
    Owed& owed = level.owed[found->second];
    if (owed.reported) fail("reported twice:", level, first, second);
    owed.reported = true;
    if (stayOf(owed, level) == kGone) fail("has left:", level, first, second);
    if (level.way < kContacts || level.way == kQuery || level.way == kOwnQuery) {
      if (found->second < level.next) fail("out of order:", level, first, second);
      level.next = found->second + 1;
    }
    if (place != ~std::size_t{0} && place != found->second)
      fail("at another place:", level, first, second);
  }
  // A call within one of the same space has no events. After a longjmp only how deep the stack is
  // tells whether a call is within.
  bool tellsOfTouches(const Level& level) {
    if (level.space != 0) return false;
    for (int i = 0; i < depth_; ++i)
      if (levels_[i].space == 0) return false;
    if (depth_ > 0 && isLocked(0)) follows_ = false;
    return follows_ && level.way == kContacts &&
           dParallelSAPSpaceGetEvents(idOf(0)) & dParallelSAPEventTouches;
  }
  // Touches that last are what the call owes, whatever its callbacks do. Before the first of them,
  // while all geoms are there.
  void followTouches(Level& level) {
    if (!level.tells) return;
    level.tells = false;
    const std::string problem = followed_.follow(begunTouchesOf(idOf(0)), endedTouchesOf(idOf(0)));
    if (problem != "") return fail(problem, level, 0, 0);
    const Pairs lasting = followed_.lasting();
    for (const Pair& touch : lasting)
      if (!level.places.count(touch)) fail("touches no more:", level, touch.first, touch.second);
    for (const auto& [touch, place] : level.places)
      if (!level.owed[place].may_miss && !std::binary_search(lasting.begin(), lasting.end(), touch))
        fail("no touch began:", level, touch.first, touch.second);
  }
  void finish(const Level& level) {
    for (const Owed& owed : level.owed)
      if (!owed.reported && !owed.may_miss && stayOf(owed, level) == kStays)
        fail("missed:", level, owed.first, owed.second);
  }

  // After a report. Holds nothing that a longjmp or throw would have to destroy.
  void act(std::size_t reported) {
    if (!problem_.empty()) return;
    const double share = levels_[depth_ - 1].share;
    while (random_.chance(share)) edit(static_cast<int>(reported));
    if (depth_ < kDeepest && random_.chance(share * 0.2)) run();
    if (random_.chance(share * 0.03)) throw Stop{1 + static_cast<int>(random_.below(2))};
    if (jumps_ && random_.chance(share * 0.05)) {
      const int to = static_cast<int>(random_.below(at(depth_)));
      for (; depth_ > to; --depth_) locked_.push_back(levels_[depth_ - 1].space);
      std::longjmp(levels_[to].back, 1);
    }
  }

  // Each such call is less deep on the stack than those before: after a longjmp it is within none.
  __attribute__((noinline)) void runBelow(std::size_t room) {
    *static_cast<volatile char*>(__builtin_alloca(room)) = 0;
    run();
  }
  // One call, within others or not.
  __attribute__((noinline)) void run() {
    prepare();
    const int depth = depth_;
    if (setjmp(levels_[depth - 1].back)) return;
    try {
      call(levels_[depth - 1]);
      followTouches(levels_[depth - 1]);
      if (problem_.empty()) finish(levels_[depth - 1]);
      depth_ = depth - 1;
    } catch (const Stop& stop) {
      depth_ = depth - 1;
      if (stop.levels > 1 && depth_ > 0) throw Stop{stop.levels - 1};
    }
  }
  void prepare() {
    Level& level = levels_[depth_];
    level.owed.clear();
    level.places.clear();
    level.next = 0;
    level.way = static_cast<Way>(random_.below(kWays));
    do level.space = random_.chance(0.7) ? 0 : anySpace();
    while (!objects_[at(level.space)].ours);
    level.own_probe = kNone;
    const std::vector<int>& members = objects_[at(level.space)].members;
    if (level.way == kOwnQuery && !members.empty()) {
      const int probe = members[random_.below(members.size())];
      if (!objects_[at(probe)].is_space) level.own_probe = probe;
    }
    for (const dGeomID ray : rays_) {
      dGeomRaySet(ray, -1, dReal(random_.between(0, side_)), dReal(random_.between(0, side_)), 1,
                  dReal(0.1), 0);
      dGeomRaySetLength(ray, dReal(2 * side_));
    }
    for (std::size_t i = 1; i < probes_.size(); ++i)
      dGeomSetPosition(probes_[i], dReal(random_.between(0, side_)),
                       dReal(random_.between(0, side_)), dReal(random_.between(0, side_)));
    dSpaceClean(idOf(level.space));  // swept bounds are in the AABBs that the oracle asks for
    oweAll(level);
    level.begin = ++time_;
    level.tells = tellsOfTouches(level);
    const double owed = static_cast<double>(level.owed.size());
    level.share = random_.chance(0.5) ? 0.5 : 10 / (10 + owed);
    if (random_.chance(0.1)) level.share = 0;
    ++depth_;
  }

  static void near(void*, dGeomID a, dGeomID b) {
    self_->report(number(a), number(b));
    self_->act(number(random(2) ? a : b));
  }
  static void block(void*, const dParallelSAPPair* pairs, size_t count, size_t first) {
    for (size_t i = 0; i < count; ++i)
      self_->report(number(pairs[i].o1), number(pairs[i].o2), first + i);
    self_->act(number(pairs[random(count)].o2));
  }
  static void touch(void*, dGeomID a, dGeomID b, const dContactGeom*, int) {
    self_->followTouches(self_->levels_[self_->depth_ - 1]);
    near(nullptr, a, b);
  }
  static void hit(void*, size_t ray, const dParallelSAPRayHit* hits, size_t count) {
    for (size_t i = 0; i < count; ++i) self_->report(ray, number(hits[i].geom));
    self_->act(number(hits[random(count)].geom));
  }
  static void overlap(void*, size_t probe, dGeomID geom, const dContactGeom*, int) {
    self_->report(probe, number(geom));
    self_->act(number(geom));
  }
  // Of dSpaceCollide2 of the space and a probe.
  static void query(void*, dGeomID own, dGeomID probe) {
    const Level& level = self_->levels_[self_->depth_ - 1];
    self_->report(level.own_probe == kNone ? 0 : number(probe), number(own));
    self_->act(number(own));
  }
  static std::size_t random(std::size_t n) { return self_->random_.below(n); }

  __attribute__((noinline)) void call(const Level& level) {
    const dSpaceID space = idOf(level.space);
    const dParallelSAPContactCallbacks contacts = dParallelSAPContactCallbacksOf(touch);
    dParallelSAPRay rays[kRayCount] = {};
    dParallelSAPProbe probes[kProbeCount] = {};
    const dGeomID probe =
        level.own_probe == kNone ? probes_[0] : objects_[at(level.own_probe)].geom;
    switch (level.way) {
      case kNear:
        return dSpaceCollide(space, nullptr, near);
      case kBlocks:
        return dParallelSAPSpaceCollidePairs(space, nullptr, 0, block);
      case kContacts:
        return dParallelSAPSpaceCollideContacts(space, nullptr, 2, &contacts);
      case kQuery:
      case kOwnQuery:
        return dSpaceCollide2(asGeom(space), probe, nullptr, query);
      case kOverlaps:
        for (std::size_t i = 0; i < kProbeCount; ++i) probes[i].geom = probes_[i];
        dParallelSAPSpaceOverlaps(space, probes, kProbeCount, sizeof *probes, 1, nullptr, overlap);
        return;
      default:
        for (std::size_t i = 0; i < kRayCount; ++i) {
          dGeomRayGet(rays_[i], rays[i].origin, rays[i].direction);
          rays[i].length = dGeomRayGetLength(rays_[i]);
        }
        dParallelSAPSpaceRayHits(space, rays, kRayCount, 1, nullptr, hit);
    }
  }

  static EditedCalls* self_;

  Random& random_;
  const bool jumps_;
  const double side_;
  std::vector<Object> objects_;
  std::vector<int> spaces_;  // alive ones
  std::vector<dGeomID> probes_, rays_;
  std::vector<int> locked_;  // spaces that were left by longjmp
  unsigned long time_ = 0;
  Level levels_[kDeepest];
  int depth_ = 0;
  Followed followed_;
  bool follows_ = true;
  std::string problem_;
};

EditedCalls* EditedCalls::self_ = nullptr;

}  // namespace

std::string playEditedCalls(Random& random, const Configuration* configuration, std::size_t geoms,
                            int calls, bool jumps) {
  auto world = std::make_unique<EditedCalls>(random, configuration, geoms, jumps);
  const std::string problem = world->play(calls);
  static auto& locked = *new std::vector<std::unique_ptr<EditedCalls>>;
  if (world->jumped()) locked.push_back(std::move(world));
  return problem;
}

}  // namespace sap_test
