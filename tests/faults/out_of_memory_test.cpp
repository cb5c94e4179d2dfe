// Allocations of the library that fail, one of them or all from one on, in the midst of any call
// that collides: what it reports is what it would have reported, and so is what follows.
#include <sys/mman.h>
#include <sys/resource.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <new>

#include "fuzz/driver.h"
#include "support/events_oracle.h"
#include "support/rules_oracle.h"
#include "support/sanitizers.h"
#include "support/tests.h"

using namespace sap_test;

namespace {

// All that this program, of which the library's objects are a part, asks of the heap and of the
// system, on any thread.
class Allocations {
 public:
  // Lets the one after so many fail, or all from then on, until the end of its life. Those of less
  // than `least` bytes do not count.
  Allocations(long passed, bool for_good, std::size_t least = 0) {
    failed_ = 0;
    least_ = least;
    for_good_ = for_good;
    left_ = passed;
    watched_ = true;
  }
  ~Allocations() { watched_ = false; }
  Allocations(const Allocations&) = delete;
  Allocations& operator=(const Allocations&) = delete;

  static bool fails(std::size_t bytes) {
    if (!watched_ || bytes < least_) return false;
    const long left = left_--;
    if (left > 0 || (left < 0 && !for_good_)) return false;
    ++failed_;
    return true;
  }
  // Since the last one came to life.
  static int failed() { return failed_; }

 private:
  inline static std::atomic<bool> watched_{false};
  inline static std::atomic<long> left_{0};
  inline static std::atomic<std::size_t> least_{0};
  inline static std::atomic<bool> for_good_{false};
  inline static std::atomic<int> failed_{0};
};

void* allocate(std::size_t bytes, std::size_t alignment) {
  void* const memory = Allocations::fails(bytes) ? nullptr
                       : alignment               ? std::aligned_alloc(alignment, bytes)
                                                 : std::malloc(bytes ? bytes : 1);
  if (!memory) throw std::bad_alloc();
  return memory;
}

}  // namespace

// All others call these.
void* operator new(std::size_t bytes) {
  return allocate(bytes, 0);
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return allocate(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

// The linker puts this in the place of the C library's (--wrap).
extern "C" {
void* __real_mmap(void* at, std::size_t bytes, int protection, int flags, int file, off_t offset);
void* __wrap_mmap(void* at, std::size_t bytes, int protection, int flags, int file, off_t offset);

void* __wrap_mmap(void* at, std::size_t bytes, int protection, int flags, int file, off_t offset) {
  return Allocations::fails(bytes) ? MAP_FAILED
                                   : __real_mmap(at, bytes, protection, flags, file, offset);
}
}

namespace {

// What dDebug becomes: nothing at all can be done.
struct GaveUp {};

// How often the library has said what it does without.
struct Said {
  int in_parts = 0, events_later = 0;

  Said() : before_(dGetMessageHandler()), debug_before_(dGetDebugHandler()) {
    said_ = this;
    dSetMessageHandler(hear);
    dSetDebugHandler([](int, const char*, va_list) { throw GaveUp(); });
  }
  ~Said() {
    dSetMessageHandler(before_);
    dSetDebugHandler(debug_before_);
  }
  Said(const Said&) = delete;
  Said& operator=(const Said&) = delete;

 private:
  static void hear(int, const char* text, va_list) {
    said_->in_parts += std::strstr(text, "pairs are found for some geoms at a time") != nullptr;
    said_->events_later += std::strstr(text, "a later frame reports the pairs") != nullptr;
  }

  inline static Said* said_ = nullptr;
  dMessageFunction *const before_, *const debug_before_;
};

// What a call has reported, in room that was there before it began.
class Report {
 public:
  explicit Report(std::size_t room) : words_(room) {}
  void add(std::uint64_t word) { put(size_, word); }
  void put(std::size_t place, std::uint64_t word) {
    if (place < words_.size()) words_[place] = word;
    for (std::size_t size = size_;
         size < place + 1 && !size_.compare_exchange_weak(size, place + 1);) {
    }
  }
  // By themselves, and by their places among all.
  void operator()(dGeomID o1, dGeomID o2) {
    add(number(o1));
    add(number(o2));
  }
  void operator()(const dParallelSAPPair* pairs, std::size_t count, std::size_t first) {
    for (std::size_t i = 0; i < count; ++i) {
      put(2 * (first + i), number(pairs[i].o1));
      put(2 * (first + i) + 1, number(pairs[i].o2));
    }
  }
  void operator()(dGeomID o1, dGeomID o2, const dContactGeom* contacts, int count) {
    (*this)(o1, o2);
    for (int i = 0; i < count; ++i) {
      addBits(contacts[i].pos);
      addBits(contacts[i].normal);
    }
  }
  void operator()(std::size_t probe, dGeomID geom, const dContactGeom* contacts, int count) {
    add(probe);
    (*this)(geom, geom, contacts, count);
  }
  void addHit(const dParallelSAPRayHit& hit) {
    add(hit.geom ? number(hit.geom) : ~std::uint64_t{0});
    if (hit.geom) addBits(hit.pos);
  }
  std::vector<std::uint64_t> words() const {
    REQUIRE(size_ <= words_.size());
    return std::vector<std::uint64_t>(words_.begin(), words_.begin() + size_);
  }
  Pairs pairs() const {
    const std::vector<std::uint64_t> all = words();
    Pairs pairs;
    for (std::size_t i = 0; i < all.size(); i += 2) pairs.emplace_back(all[i], all[i + 1]);
    return pairs;
  }

 private:
  void addBits(const dVector3 vector) {
    for (int axis = 0; axis < 3; ++axis) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &vector[axis], sizeof vector[axis]);
      add(bits);
    }
  }

  std::vector<std::uint64_t> words_;
  std::atomic<std::size_t> size_{0};
};

// The driver's world, asked in many ways. Of one seed it is the same with failures and without.
class AskedScene : private Decisions, public Driver {
 public:
  explicit AskedScene(std::uint64_t seed)
      : Decisions(seed), Driver(*this, kMost, &configurations()[0]), random_(seed) {
    changes_users_unasked_ = false;  // which a frame may notice or not
    for (int i = 0; i < 4; ++i) populate();
    dParallelSAPSpaceSetEvents(space(), static_cast<int>(random_.below(4)));
    dGeomRaySet(probe_, 0, 0, 0, 1, 1, 1);
  }
  ~AskedScene() {
    dGeomDestroy(probe_);
    dGeomDestroy(ball_);
  }

  // What changes between two calls, nothing at times.
  void change() {
    for (std::size_t edits = random_.below(5); edits > 0; --edits) step(false);
    dParallelSAPSpaceSetNumThreads(space(), threads_);  // edits may have asked for others
    kind_ = random_.below(7);
    // The oracle of pairs needs them all.
    if (kind_ == contacts && dParallelSAPSpaceGetEvents(space()) == dParallelSAPEventPairs)
      kind_ = pairs;
    if (dParallelSAPSpaceGetEvents(space()) & dParallelSAPEventTouches && random_.chance(0.4))
      kind_ = contacts;
    // What ODE cannot collide is passed, and something else for each query.
    const auto filter = [](void* rays, std::size_t query, dGeomID geom) {
      return int(isTame(geom, rays) && (query + number(geom)) % 5 != 0);
    };
    dParallelSAPSpaceSetQueryFilter(space(), kind_ >= rays_too ? +filter : nullptr,
                                    kind_ == rays_too ? this : nullptr);
  }

  // Asks; of allocations that are watched meanwhile it makes none.
  template <class Watch>
  std::vector<std::uint64_t> ask(Watch watch) {
    Report report(kMost * kMost);  // of all pairs
    std::array<dParallelSAPRay, 200> rays = {};
    std::array<dParallelSAPRayHit, 200> hits = {};
    if (kind_ == rays_too)
      for (dParallelSAPRay& ray : rays) {
        const auto any = [&](double low) { return random_.between(low, low < 0 ? 1 : 9); };
        ray = rayOf({any(0), any(0), any(0)}, {any(-1), any(-1), any(-1)}, any(0));
      }
    {
      [[maybe_unused]] const auto watching = watch();
      call(report, rays, hits);
    }
    if (kind_ == rays_too)
      for (const dParallelSAPRayHit& hit : hits) report.addHit(hit);
    if (tells()) told_ = report.pairs();
    return report.words();
  }

  // What is wrong about the last call's pairs, by the rules, and about its statistics.
  std::string wrongReport() const {
    if (!tells()) return "";
    const std::string pairs = wrongByRules(Rules::of(space()), order(), told_);
    return pairs != "" || dParallelSAPSpaceGetSkipAsleep(space())
               ? pairs
               : wrongCounts(space(), order(), told_.size());
  }
  // Which pairs further apart a tolerance lets through depends on what is kept.
  bool isRepeatable() const {
    return kind_ >= query || dParallelSAPSpaceGetTolerance(space()) == 0;
  }
  // What is wrong about what began and ended, if the last call tells of that.
  std::string checkEvents(bool may_have_failed) {
    if (dParallelSAPSpaceGetEvents(space()) != dParallelSAPEventPairs || !tells()) return "";
    const bool nothing =
        numbersOf(space()).empty() && begunOf(space()).empty() && endedOf(space()).empty();
    if (may_have_failed && nothing) return "";
    EventsOracle::Geoms geoms;
    addGeoms(0, false, geoms);
    return oracle_.check(space(), pairsByStay(told_), geoms);
  }
  // The same where touches are told, too: what lasts is what does in the other scene. What rests
  // may have begun or ended in a frame that failed.
  std::string checkTouches(const AskedScene& whole, bool may_have_failed) {
    if (!(dParallelSAPSpaceGetEvents(space()) & dParallelSAPEventTouches) || kind_ > contacts)
      return "";
    const bool rests =
        dParallelSAPSpaceGetSkipStatic(space()) || dParallelSAPSpaceGetSkipAsleep(space());
    for (const bool of_touches : {false, true}) {
      const Events begun = of_touches ? begunTouchesOf(space()) : begunOf(space()),
                   ended = of_touches ? endedTouchesOf(space()) : endedOf(space());
      Followed& own = followed_[of_touches];
      const std::string problem = own.follow(begun, ended);
      if (problem != "") return problem + (of_touches ? " (touches)" : " (pairs)");
      if (of_touches && kind_ != contacts && begun.size() + ended.size() > 0)
        return "touches changed without contacts";
      const bool told = of_touches ? kind_ == contacts : isRepeatable();
      const bool nothing = begun.empty() && ended.empty();
      if (!told || rests || (may_have_failed && nothing)) continue;
      if (own.lasting() != whole.followed_[of_touches].lasting())
        return of_touches ? "other touches last" : "other pairs last";
      compared_ += of_touches && !nothing;
    }
    return "";
  }
  int compared() const { return compared_; }
  std::size_t kind() const { return kind_; }
  // Contacts, rays and probes need memory for those of one pair, ray or probe.
  bool needsSome() const { return kind_ == contacts || kind_ >= rays_too; }

 private:
  enum Kind : std::size_t { pairs, blocks, shared_blocks, contacts, query, rays_too, probes };

  static constexpr std::size_t kMost = 700;
  static constexpr dReal kSide = 9;  // where most geoms are

  bool tells() const { return kind_ <= shared_blocks; }
  void call(Report& report, const std::array<dParallelSAPRay, 200>& rays,
            std::array<dParallelSAPRayHit, 200>& hits) {
    const auto flags = [](void*, dGeomID a, dGeomID b) { return isTame(a) && isTame(b) ? 4 : 0; };
    const dParallelSAPContactCallbacks callbacks = {invoke<Report>, flags, nullptr, nullptr};
    switch (kind_) {
      case pairs:
        return dSpaceCollide(space(), &report, invoke<Report>);
      case blocks:
        return dParallelSAPSpaceCollidePairs(space(), &report, 0, invoke<Report>);
      case shared_blocks:
        return dParallelSAPSpaceCollidePairs(space(), &report, dParallelSAPPairsConcurrent,
                                             invoke<Report>);
      case contacts:
        return dParallelSAPSpaceCollideContacts(space(), &report, 0, &callbacks);
      case query:
        return dSpaceCollide2(asGeom(space()), probe_, &report, invoke<Report>);
      case probes: {
        dParallelSAPProbe two[2] = {{probe_, nullptr, 0}, {ball_, nullptr, 0}};
        dParallelSAPSpaceOverlaps(space(), two, 2, sizeof two[0], 4, &report, invoke<Report>);
        return;
      }
      default:
        dParallelSAPSpaceRays(space(), rays.data(), rays.size(), 0, hits.data());
    }
  }
  Random random_;
  const int threads_ = random_.chance(0.5) ? 1 : 3;
  const dGeomID probe_ = dCreateRay(nullptr, kSide), ball_ = dCreateSphere(nullptr, 1);
  std::size_t kind_ = pairs;
  Pairs told_;
  EventsOracle oracle_;
  Followed followed_[2];  // pairs, touches
  int compared_ = 0;      // frames whose touches changed
};

void countPair(void* count, dGeomID, dGeomID) {
  ++*static_cast<std::size_t*>(count);
}

// The pairs of a collide in which the allocation after so many fails, or all from then on.
std::size_t pairsWithout(dSpaceID space, long passed, bool for_good) {
  std::size_t pairs = 0;
  const Allocations allocations(passed, for_good);
  dSpaceCollide(space, &pairs, countPair);
  return pairs;
}

std::size_t pairsOf(dSpaceID space) {
  return pairsWithout(space, std::numeric_limits<long>::max(), false);
}

}  // namespace

TEST_CASE("Whatever allocation fails, nothing is lost of what is reported", "[memory]") {
  Random random(seedOr(341));
  int failures = 0, given_up = 0, widest = 0, touching = 0, in_parts = 0, events_later = 0;
  for (int scene = 0; scene < scaled(300); ++scene) {
    const std::uint64_t seed = random.bits();
    AskedScene whole(seed), hurt(seed);
    const Said said;
    for (int frame = 0; frame < 12; ++frame) {
      whole.change();
      hurt.change();
      const auto expected = whole.ask([] { return 0; });
      // Few are asked for by frames that find their storage from before.
      const long passed = static_cast<long>(random.below(std::size_t{1} << random.below(7)));
      const bool for_good = random.chance(0.3), fails = random.chance(0.6);
      bool gave_up = false;
      std::vector<std::uint64_t> got;
      try {
        got = hurt.ask([&] { return Allocations(fails ? passed : 1000000, for_good); });
      } catch (const GaveUp&) {
        gave_up = true;
      } catch (const std::bad_alloc&) {  // of a call with a filter, which may throw
        gave_up = true;
      }
      const bool failed = Allocations::failed() > 0;
      failures += failed;
      widest = std::max(widest, statsOf(hurt.space()).threads);
      INFO("scene " << scene << " (" << seed << "), frame " << frame << ", call " << hurt.kind()
                    << ", " << hurt.order().size() << " geoms, allocations " << passed
                    << (for_good ? " and all later ones" : "") << (fails ? "" : " none"));
      REQUIRE(whole.kind() == hurt.kind());
      if (gave_up) {
        REQUIRE(hurt.needsSome());
        REQUIRE((failed && for_good));
        ++given_up;
        REQUIRE(whole.checkTouches(whole, false) == "");
        REQUIRE(hurt.checkTouches(whole, true) == "");
        continue;
      }
      REQUIRE((got == expected || !hurt.isRepeatable()));
      REQUIRE(hurt.wrongReport() == "");
      REQUIRE(whole.checkEvents(false) == "");
      REQUIRE(hurt.checkEvents(failed) == "");
      REQUIRE(whole.checkTouches(whole, false) == "");
      REQUIRE(hurt.checkTouches(whole, failed) == "");
    }
    touching += hurt.compared();
    in_parts += said.in_parts;
    events_later += said.events_later;
  }
  CHECK(failures > scaled(300));
  CHECK(in_parts > scaled(30));
  CHECK(events_later > 0);
  CHECK(given_up > 0);
  CHECK(touching > scaled(100));
  if (std::getenv("ODE_PARALLEL_SAP_TEST_GRAIN")) CHECK(widest == 3);
}

TEST_CASE("A contact callback that throws without memory leaves no space locked", "[memory]") {
  const Said said;
  const auto count = [](void* data, dGeomID a, dGeomID b, const dContactGeom*, int) {
    countPair(data, a, b);
  };
  int thrown_within = 0;
  for (dSpaceID (*const create)(dSpaceID) : {dSimpleSpaceCreate, dHashSpaceCreate}) {
    for (long passed = 0; passed < 40; ++passed) {
      const Space space;
      // A space in a space, so that ODE locks two.
      const dSpaceID outer = create(space), inner = create(outer);
      dGeomID geom = nullptr;
      for (int i = 0; i < 20; ++i) {
        dCreateSphere(space, 1);
        geom = dCreateSphere(i % 2 ? outer : inner, 1);
      }
      dParallelSAPContactCallbacks callbacks = dParallelSAPContactCallbacksOf(
          +[](void*, dGeomID, dGeomID, const dContactGeom*, int) { throw 1; });
      bool thrown = false;
      try {
        const Allocations allocations(passed, false);
        dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
      } catch (int) {
        thrown = true;
      }
      INFO("allocation " << passed);
      CHECK(thrown);
      thrown_within += Allocations::failed() > 0;
      CHECK_NOTHROW(dGeomSetPosition(geom, 0, 0, real(0.5)));
      callbacks.contacts = count;
      std::size_t pairs = 0;
      dParallelSAPSpaceCollideContacts(space, &pairs, 1, &callbacks);
      CHECK(pairs == 190 + 400);
    }
  }
  CHECK(thrown_within > 0);
}

TEST_CASE("Wherever memory ends the frame counts its geoms, or begins anew and the next one keeps",
          "[memory]") {
  Said said;
  for (const bool for_good : {true, false})
    for (const int threads : {1, 3}) {
      bool fails = true;
      for (int passed = 0; fails; ++passed) {
        const Space space;
        World world(space, denseCube(300, 5));
        dParallelSAPSpaceSetNumThreads(space, threads);
        const bool skips = for_good && passed % 2;
        dParallelSAPSpaceSetSkipStatic(space, skips);
        dParallelSAPSpaceSetNotified(space, for_good);
        const std::size_t pairs = pairsWithout(space, passed, for_good);
        fails = Allocations::failed() > 0;
        INFO("allocation " << passed << ", for good " << for_good << ", " << threads << " threads");
        CHECK((pairs == 0) == skips);
        CHECK(statsOf(space).moved == 300);
        CHECK(wrongCounts(space, world.geoms(), pairs) == "");
        if (!for_good) CHECK(statsOf(space).method == dParallelSAPMethodSweep);
        if (for_good)
          for (const dGeomID geom : world.geoms()) dParallelSAPSpaceNotify(space, geom);
        CHECK(pairsOf(space) == pairs);
        if (!for_good) CHECK(statsOf(space).kept == pairs);
      }
      if (for_good) CHECK(std::exchange(said.in_parts, 0) > 10);
    }
  CHECK(said.in_parts == 0);
}

TEST_CASE(
    "Where large allocations fail a frame's time is linear, and at most twelve times a whole one",
    "[memory]") {
  const Said said;
  const auto timeOf = [](std::size_t n, double from, bool fails) {
    const Space space;
    World world(space);
    dParallelSAPSpaceSetNumThreads(space, 1);
    Boxes boxes = denseCube(n, 15);
    for (std::size_t i = 0; i < n; i += 2)
      for (double* const bounds : {boxes[i].low, boxes[i].high}) bounds[0] += from;
    world.addBoxes(boxes);
    std::size_t pairs = 0;
    const Allocations allocations(0, true, fails ? 16 * n : std::numeric_limits<long>::max());
    const std::clock_t before = std::clock();
    dSpaceCollide(space, &pairs, countPair);
    const std::clock_t after = std::clock();
    REQUIRE((statsOf(space).method == dParallelSAPMethodBruteForce) == fails);
    return static_cast<double>(after - before);
  };
  // Floats of such numbers are 1024 apart, and in single precision all are alike.
  constexpr double distance = sizeof(dReal) > sizeof(float) ? 1e10 : 0;
  // In turn, as a machine may be slower for a while.
  double few = std::numeric_limits<double>::infinity(), many = few, whole = few, far = few;
  for (int repeat = 0; repeat < 6; ++repeat) {
    few = std::min(few, timeOf(5000, 0, true));
    many = std::min(many, timeOf(20000, 0, true));
    whole = std::min(whole, timeOf(20000, 0, false));
    far = std::min(far, timeOf(20000, distance, true));
  }
  INFO(many / few << " times as long for four times as many geoms, " << many / whole
                  << " times a whole frame");
  CHECK(many < 10 * few);
  if (ADDRESS_SANITIZER || THREAD_SANITIZER)
    WARN("SKIPPED: a comparison with vectors, which cost a sanitizer less than other loops");
  else
    CHECK(many < 12 * whole);
  INFO(far / many << " times as long if half of them are far away");
  CHECK(far < 3 * many);
}

#if !ADDRESS_SANITIZER && !THREAD_SANITIZER
TEST_CASE("A frame causes no page fault where balls move steadily among tiles that touch",
          "[memory]") {
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, 1);
  for (int tile = 0; tile < 4096; ++tile)
    dGeomSetPosition(dCreateBox(space, 64, 64, 2), real(64 * (tile % 64)), real(64 * (tile / 64)),
                     0);
  Random random(seedOr(321));
  std::vector<std::pair<dGeomID, dReal>> balls;  // and their ways in a frame
  for (int ball = 0; ball < 410; ++ball) {
    balls.push_back({dCreateSphere(space, dReal(0.5)), dReal(random.chance(0.5) ? 0.05 : -0.05)});
    dGeomSetPosition(balls.back().first, dReal(random.between(1900, 2140)),
                     dReal(random.between(1900, 2140)), dReal(random.between(2, 30)));
  }
  rusage settled = {}, then = {};
  for (int frame = 0; frame < 120; ++frame) {
    for (const auto& [ball, way] : balls) moveBy(ball, way, 0, 0);
    dSpaceCollide(space, nullptr, [](void*, dGeomID, dGeomID) {});
    if (frame == 69) getrusage(RUSAGE_SELF, &settled);
  }
  getrusage(RUSAGE_SELF, &then);
  CHECK(then.ru_minflt - settled.ru_minflt < 5);  // in fifty frames; some may be the system's
}
#endif
