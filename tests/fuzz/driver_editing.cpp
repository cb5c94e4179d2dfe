// Calls whose callbacks edit the world, call again, throw and leave by longjmp, checked against one
// rule: what has left since a call began is in none of its further reports, and what came takes
// part in calls that begin later.
#include <array>
#include <csetjmp>

#include "driver.h"

namespace sap_test {
namespace {

enum Way { kNear, kBlocks, kContacts, kQuery, kOwnQuery, kRays, kOverlaps, kWays };
enum Stay { kStays, kMayStay, kGone };

constexpr std::size_t kDeepest = 3;  // levels of calls within calls

// Where ODE asserts, geoms of a locked space may only be destroyed and change silently.
bool odeAsserts() {
  return dCheckConfiguration("ODE_EXT_no_debug") == 0;
}

struct Stop {
  int levels;  // that it is to leave
};

// What is owed: two geoms, or a ray or probe and a geom.
struct Owed {
  Pair pair;
  // Both, or the one, with the spaces around them up to that of the call.
  std::vector<std::vector<int>> chains = {};
};

// A call that runs.
struct Level {
  std::jmp_buf back = {};
  Way way = kNear;
  int space = 0;
  dGeomID probe = nullptr;
  unsigned long begin = 0;
  std::vector<Owed> owed = {};
  std::size_t next = 0;  // in `owed`
  bool tells = false;    // touches, which were not looked at yet
  double share = 0;      // how often it changes something
  RayBatch rays;
  ProbeBatch probes;

  explicit Level(Random& random) : rays(12, random), probes(4, random) {}
};

}  // namespace

class Driver::Editing {
 public:
  // For its life, no rule leaves a choice of what is owed.
  Editing(Driver& world, Random& random, bool jumps)
      : world_(world),
        random_(random),
        jumps_(jumps),
        events_(dParallelSAPSpaceGetEvents(world.space())),
        levels_{Level(random), Level(random), Level(random)} {
    const bool skips = random_.chance(0.25);  // as the spaces do
    const Rules own = Rules::of(world_.space());
    follows_ = !(skips && (own.skip_static || own.skip_asleep)) && world_.locked_.empty();
    dParallelSAPSpaceSetEvents(world_.space(), 0);
    dParallelSAPSpaceSetEvents(world_.space(), static_cast<int>(random_.below(4)));
    for (const int space : world_.spaces_) {
      if (!world_.objects_[space].ours) continue;
      const dSpaceID id = world_.spaceOf(space);
      settings_.push_back({space, Rules::of(id), dParallelSAPSpaceGetSweptBounds(id)});
      Rules rules;
      rules.skip_static = skips && settings_.back().rules.skip_static;
      rules.skip_asleep = skips && settings_.back().rules.skip_asleep;
      set({space, rules, space == 0 ? settings_.back().swept : 0});
    }
  }
  ~Editing() {
    dParallelSAPSpaceSetEvents(world_.space(), events_);
    for (const Settings& settings : settings_)
      if (world_.objects_[settings.space].geom) set(settings);
  }
  Editing(const Editing&) = delete;
  Editing& operator=(const Editing&) = delete;

  void play(int calls) {
    for (int i = 0; i < calls && world_.problem_.empty(); ++i) {
      edit(kNone);
      markSome();
      runBelow(4096 * static_cast<std::size_t>(calls - i));
    }
  }

 private:
  struct Settings {
    int space;
    Rules rules;
    dReal swept;
  };

  void set(const Settings& settings) const {
    const dSpaceID id = world_.spaceOf(settings.space);
    dParallelSAPSpaceSetSkipStatic(id, settings.rules.skip_static);
    dParallelSAPSpaceSetSkipAsleep(id, settings.rules.skip_asleep);
    dParallelSAPSpaceSetCullPlanes(id, settings.rules.cull_planes);
    dParallelSAPSpaceSetTolerance(id, settings.rules.tolerance);
    dParallelSAPSpaceSetSweptBounds(id, settings.swept);
  }
  const Object& at(int object) const { return world_.objects_[object]; }
  Level& top() { return levels_[depth_ - 1]; }

  // --- Edits ---

  bool isLocked(int space) const {
    for (std::size_t i = 0; i < depth_; ++i)
      if (levels_[i].space == space) return true;
    const std::vector<int>& locked = world_.locked_;
    return std::find(locked.begin(), locked.end(), space) != locked.end();
  }
  bool mayChange(int space) const { return space == kNone || !odeAsserts() || !isLocked(space); }
  // With the others on its body.
  bool mayMove(int leaf) const {
    const int body = at(leaf).body;
    return std::all_of(world_.alive_.begin(), world_.alive_.end(), [&](int other) {
      const bool stays = other != leaf && (body == kNone || at(other).body != body);
      return stays || mayChange(at(other).parent);
    });
  }
  int anyChangeable() {
    for (int i = 0; i < 5; ++i)
      if (const int space = world_.spaces_[random_.below(world_.spaces_.size())]; mayChange(space))
        return space;
    return kNone;
  }
  // Moves nothing, but what changed silently is known after.
  void markSome() {
    const double share = random_.chance(0.3) ? 1 : random_.unit() * random_.unit();
    for (const int leaf : world_.alive_)
      if ((at(leaf).kind == kUser || at(leaf).kind == kMesh || random_.chance(share)) &&
          mayMove(leaf))
        world_.markMoved(leaf);
  }
  void create() {
    const int space = anyChangeable();
    if (space == kNone || world_.alive_.size() >= world_.most_geoms_) return;
    const Kind kind = random_.chance(0.8) ? kSphere : static_cast<Kind>(random_.below(kLeafKinds));
    const int leaf = world_.createLeaf(kind, random_);
    world_.place(leaf, 0, random_);
    world_.add(leaf, space);
  }
  // Into some space, or nowhere.
  void add(int object, int space) {
    if (space != kNone && !world_.isInside(space, object)) world_.add(object, space);
  }
  void editSpace(int space) {
    const int parent = at(space).parent;
    for (const int each : world_.spaces_)
      if (each == 0 || isLocked(each))
        if (world_.isInside(each, space)) return;
    if (random_.chance(0.2)) return world_.destroy(space);
    if (!mayChange(parent)) return;
    if (parent != kNone) world_.remove(space);
    add(space, random_.chance(0.5) ? parent : anyChangeable());
    if (at(space).parent == kNone && mayChange(0)) world_.add(space, 0);
  }
  // `reported`: of the geom that a callback has just got.
  void edit(int reported) {
    const bool alive = reported != kNone && at(reported).geom;
    if (world_.alive_.empty()) return create();
    const int leaf = alive && at(reported).kind != kSpace && random_.chance(0.5)
                         ? reported
                         : world_.alive_[random_.below(world_.alive_.size())];
    const int parent = at(leaf).parent;
    switch (const std::size_t what = random_.below(11)) {
      case 0:
        return create();
      case 1:
        if (const int space = anyChangeable();
            space != kNone && world_.spaces_.size() < kMostSpaces && random_.chance(0.2))
          world_.createSpace(random_.chance(0.5), space);
        return;
      case 2:
        if (random_.chance(0.2)) editSpace(world_.spaces_[random_.below(world_.spaces_.size())]);
        return;
      case 3:
      case 4:
        world_.destroy(leaf);
        if (random_.chance(0.5)) create();  // often at the same address
        return;
      case 5:  // back at once, elsewhere, or nowhere
      case 6:
      case 7:  // by way of another space
        if (!mayMove(leaf)) return;
        if (parent != kNone) world_.remove(leaf);
        add(leaf, what == 5 ? parent : anyChangeable());
        if (what != 7 || at(leaf).parent == kNone || !mayChange(parent)) return;
        world_.remove(leaf);
        return add(leaf, parent);
      case 8:
        if (const int body = at(leaf).body; body != kNone && random_.chance(0.5)) {
          (random_.chance(0.5) ? dBodyEnable : dBodyDisable)(world_.bodies_[body]);
          return world_.tellOfAll();
        }
        random_.chance(0.8) ? world_.changeEnabled(leaf, random_.chance(0.7), random_)
                            : world_.changeBits(leaf, random_.below(6), random_);
        return world_.tell(leaf);
      default:
        if (parent != kNone && mayMove(leaf)) world_.changeAnyhow(leaf, random_);
    }
  }

  // --- What is owed ---

  std::vector<int> chainOf(int object, int space) const {
    std::vector<int> chain;
    for (; object != kNone && object != space; object = at(object).parent) chain.push_back(object);
    return chain;
  }
  void owe(Level& level, std::size_t first, std::size_t second, bool both) const {
    level.owed.push_back({Pair(first, second)});
    std::vector<std::vector<int>>& chains = level.owed.back().chains;
    chains.push_back(chainOf(static_cast<int>(second), level.space));
    if (both) chains.push_back(chainOf(static_cast<int>(first), level.space));
  }
  void oweAll(Level& level) {
    const dSpaceID id = world_.spaceOf(level.space);
    const std::vector<dGeomID> geoms = world_.membersOf(level.space);
    SerialLoop loop;
    loop.flags_of = flagsOf;
    switch (level.way) {
      case kNear:
      case kBlocks:
        for (const Pair& pair : world_.owedPairs(level.space))
          owe(level, pair.first, pair.second, true);
        break;
      case kContacts:
        for (const Contact& each :
             world_.expectedContacts(world_.owedPairs(level.space), loop, true))
          if (const Pair pair(number(each.o1), number(each.o2));
              level.owed.empty() || level.owed.back().pair != pair)
            owe(level, pair.first, pair.second, true);
        break;
      case kQuery:
      case kOwnQuery:
        for (const dGeomID geom : geoms)
          if (takesPart(geom) && mayProbe(level.probe) && mayTouch(geom, level.probe))
            owe(level, number(level.probe), number(geom), level.way == kOwnQuery);
        break;
      case kRays: {
        const auto all = owedRays(geoms, level.rays.rays, 1, mayHit<true>).all;
        for (std::size_t ray = 0; ray < all.size(); ++ray)
          for (const dParallelSAPRayHit& hit : all[ray]) owe(level, ray, number(hit.geom), false);
        break;
      }
      default: {
        const auto all = owedOverlaps(id, level.probes.probes, 1, mayHit<false>).contacts;
        for (std::size_t probe = 0; probe < all.size(); ++probe)
          for (const Contact& contact : all[probe]) owe(level, probe, number(contact.o2), false);
      }
    }
  }
  // A space of ours knows for sure what left it. A stock space tells too little: what leaves it and
  // comes back may count as there all along.
  Stay stayOf(const std::vector<int>& chain, const Level& level) const {
    unsigned long first = ~0ul;  // when it did so first, alone or with the spaces around it
    bool is_sure = false;
    for (const int object : chain) {
      for (const auto& [time, space] : at(object).left) {
        if (time <= level.begin || time >= first) continue;
        first = time;
        is_sure = at(space).ours;
      }
    }
    if (first == ~0ul) return kStays;
    if (is_sure) return kGone;
    const std::vector<int> now = chainOf(chain.front(), level.space);
    const bool is_back = at(chain.front()).geom && now.back() == chain.back() &&
                         at(now.back()).parent == level.space;
    return is_back ? kMayStay : kGone;
  }
  Stay stayOf(const Owed& owed, const Level& level) const {
    Stay stay = kStays;
    for (const std::vector<int>& chain : owed.chains) stay = std::max(stay, stayOf(chain, level));
    return stay;
  }

  // --- The calls ---

  void fail(const std::string& what, const Pair& pair) {
    world_.fail("way " + std::to_string(top().way) + " at depth " + std::to_string(depth_) +
                " of space " + std::to_string(top().space) + ": " + what + " " +
                std::to_string(pair.first) + ", " + std::to_string(pair.second));
  }
  // What is owed before this pair, or at all, has left meanwhile or was reported.
  void skipTo(const Pair* pair) {
    Level& level = top();
    for (; level.next < level.owed.size(); ++level.next) {
      const Owed& owed = level.owed[level.next];
      if (pair && owed.pair == *pair) return;
      if (stayOf(owed, level) == kStays) return fail("missed:", owed.pair);
    }
    if (pair) fail("not owed, or out of order:", *pair);
  }
  void report(std::size_t first, std::size_t second) {
    if (!world_.problem_.empty()) return;
    const Pair pair(first, second);
    skipTo(&pair);
    if (world_.problem_.empty() && stayOf(top().owed[top().next++], top()) == kGone)
      fail("has left:", pair);
  }
  // A call within one of the same space has no events. After a longjmp only how deep the stack is
  // tells whether a call is within.
  bool tellsOfTouches(const Level& level) {
    if (level.space != 0) return false;
    for (std::size_t i = 0; i < depth_; ++i)
      if (levels_[i].space == 0) return false;
    if (depth_ > 0 && isLocked(0)) follows_ = false;
    return follows_ && level.way == kContacts &&
           dParallelSAPSpaceGetEvents(world_.space()) & dParallelSAPEventTouches;
  }
  // Touches that last are what the call owes, whatever its callbacks do. Before the first of them,
  // while all geoms are there.
  void followTouches() {
    if (!std::exchange(top().tells, false)) return;
    const dSpaceID id = world_.space();
    std::string problem = followed_.follow(begunTouchesOf(id), endedTouchesOf(id));
    Pairs touches;
    for (const Owed& owed : top().owed) touches.push_back(owed.pair);
    if (problem.empty()) problem = difference(followed_.lasting(), asSet(touches));
    if (!problem.empty()) fail("touches: " + problem, {});
  }

  // After a report. Holds nothing that a longjmp or throw would have to destroy.
  void act(std::size_t reported) {
    if (!world_.problem_.empty()) return;
    const double share = top().share;
    while (random_.chance(share)) edit(static_cast<int>(reported));
    if (depth_ < kDeepest && random_.chance(share * 0.2)) run();
    if (random_.chance(share * 0.03)) throw Stop{1 + static_cast<int>(random_.below(2))};
    if (jumps_ && random_.chance(share * 0.05)) {
      const std::size_t to = random_.below(depth_);
      for (; depth_ > to; --depth_) world_.locked_.push_back(top().space);
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
    const std::size_t depth = depth_;
    if (setjmp(levels_[depth - 1].back)) return;
    try {
      call(levels_[depth - 1]);
      followTouches();
      if (world_.problem_.empty()) skipTo(nullptr);
      depth_ = depth - 1;
    } catch (const Stop& stop) {
      depth_ = depth - 1;
      if (stop.levels > 1 && depth_ > 0) throw Stop{stop.levels - 1};
    }
  }
  void prepare() {
    Level& level = levels_[depth_];
    level.owed.clear();
    level.next = 0;
    level.way = static_cast<Way>(random_.below(kWays));
    do level.space = random_.chance(0.7) ? 0 : world_.spaces_[random_.below(world_.spaces_.size())];
    while (!at(level.space).ours);
    const dSpaceID id = world_.spaceOf(level.space);
    dSpaceClean(id);  // swept bounds are in the AABBs that the oracle asks for
    std::vector<dGeomID> tame;
    for (const int object : world_.within(level.space))
      if (at(object).kind < kUser && isTame(at(object).geom)) tame.push_back(at(object).geom);
    if (tame.empty()) tame.push_back(level.probes.probes[0].geom);
    level.rays.moveTo(tame);
    level.probes.moveTo(tame);
    level.probe = level.probes.probes[0].geom;
    const int own = world_.pickMember(level.space, random_);
    if (level.way == kOwnQuery && own != kNone && at(own).kind != kSpace)
      level.probe = at(own).geom;
    else if (level.way == kOwnQuery)
      level.way = kQuery;
    dParallelSAPSpaceSetQueryFilter(id, level.way == kRays ? filter<true> : filter<false>, nullptr);
    oweAll(level);
    level.begin = ++world_.time_;
    level.tells = tellsOfTouches(level);
    const double owed = static_cast<double>(level.owed.size());
    level.share = random_.chance(0.5) ? 0.5 : 10 / (10 + owed);
    if (random_.chance(0.1)) level.share = 0;
    ++depth_;
  }

  static Editing& of(void* data) { return *static_cast<Editing*>(data); }
  static int flagsOf(void*, dGeomID a, dGeomID b) { return isTame(a) && isTame(b) ? 2 : 0; }
  template <bool by_rays>
  static bool mayHit(std::size_t, dGeomID geom) {
    return isTame(geom, by_rays);
  }
  template <bool by_rays>
  static int filter(void*, std::size_t, dGeomID geom) {
    return isTame(geom, by_rays);
  }
  static void near(void* data, dGeomID a, dGeomID b) {
    of(data).report(number(a), number(b));
    of(data).act(number(of(data).random_.chance(0.5) ? a : b));
  }
  static void block(void* data, const dParallelSAPPair* pairs, size_t count, size_t first) {
    Editing& self = of(data);
    for (size_t i = 0; i < count; ++i) {
      self.report(number(pairs[i].o1), number(pairs[i].o2));
      if (self.top().next != first + i + 1) self.fail("at another place:", Pair(first, i));
    }
    self.act(number(pairs[self.random_.below(count)].o2));
  }
  static void touch(void* data, dGeomID a, dGeomID b, const dContactGeom*, int) {
    of(data).followTouches();
    near(data, a, b);
  }
  static void hit(void* data, size_t ray, const dParallelSAPRayHit* hits, size_t count) {
    for (size_t i = 0; i < count; ++i) of(data).report(ray, number(hits[i].geom));
    of(data).act(number(hits[of(data).random_.below(count)].geom));
  }
  static void overlap(void* data, size_t probe, dGeomID geom, const dContactGeom*, int) {
    of(data).report(probe, number(geom));
    of(data).act(number(geom));
  }
  // Of dSpaceCollide2 of the space and a probe.
  static void query(void* data, dGeomID own, dGeomID probe) {
    of(data).report(number(probe), number(own));
    of(data).act(number(own));
  }

  __attribute__((noinline)) void call(Level& level) {
    const dSpaceID space = world_.spaceOf(level.space);
    const dParallelSAPContactCallbacks contacts = {touch, flagsOf, nullptr, nullptr};
    const Rays& rays = level.rays.rays;
    Probes& probes = level.probes.probes;
    switch (level.way) {
      case kNear:
        return dSpaceCollide(space, this, near);
      case kBlocks:
        return dParallelSAPSpaceCollidePairs(space, this, 0, block);
      case kContacts:
        return dParallelSAPSpaceCollideContacts(space, this, 0, &contacts);
      case kQuery:
      case kOwnQuery:
        return dSpaceCollide2(asGeom(space), level.probe, this, query);
      case kOverlaps:
        dParallelSAPSpaceOverlaps(space, probes.data(), probes.size(), sizeof probes[0], 1, this,
                                  overlap);
        return;
      default:
        dParallelSAPSpaceRayHits(space, rays.data(), rays.size(), 1, this, hit);
    }
  }

  Driver& world_;
  Random& random_;
  const bool jumps_;
  const int events_;  // as they were
  std::array<Level, kDeepest> levels_;
  std::size_t depth_ = 0;
  std::vector<Settings> settings_;  // likewise
  Followed followed_;
  bool follows_ = true;
};

void Driver::playEditedCalls(Random& random, int calls, bool jumps) {
  Editing(*this, random, jumps).play(calls);
}

// In worlds that the oracle takes no time for.
void Driver::collideEditing() {
  Random random = decisions_.random();
  if (alive_.size() > 1000) return collidePlain(0);
  log("calls with edits");
  playEditedCalls(random, alive_.size() > 200 ? 1 : 4, false);
  ++collides_;
  collidePlain(0);
}

}  // namespace sap_test
