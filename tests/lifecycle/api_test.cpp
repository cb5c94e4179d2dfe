// Settings, statistics, wrong arguments.
#include <array>
#include <cstddef>
#include <cstring>
#include <functional>

#include "support/contact_scene.h"
#include "support/tests.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

struct Setting {
  std::string name;
  std::function<void(dSpaceID, dReal)> set;
  std::function<dReal(dSpaceID)> get;
  std::vector<std::pair<dReal, dReal>> values;  // and what they become
  std::vector<dReal> errors;
};
#define SETTING(name) #name, dParallelSAPSpaceSet##name, dParallelSAPSpaceGet##name
const std::vector<std::pair<dReal, dReal>> kSwitch = {{1, 1}, {7, 1}, {0, 0}};
const dReal kMost = std::numeric_limits<dReal>::max();
const std::vector<std::pair<dReal, dReal>> kDistance = {
    {dReal(0.25), dReal(0.25)}, {kMost, kMost}, {0, 0}};
// Backend and Method answer whether they were taken: tested on their own.
const Setting kSettings[] = {
    {SETTING(Backend), {}, {}},
    {SETTING(Method), {}, {}},
    {SETTING(NumThreads), {{1, 1}, {2, 2}, {7, 7}, {256, 256}, {100000, 256}, {0, 0}}, {-1}},
    {SETTING(NumDevices), {{1, 1}, {2, 2}, {8, 8}, {0, 0}}, {-1}},
    {SETTING(SkipStatic), kSwitch, {}},
    {SETTING(SkipAsleep), kSwitch, {}},
    {SETTING(CullPlanes), kSwitch, {}},
    {SETTING(Events), {{1, 1}, {2, 2}, {3, 3}, {0, 0}}, {4, -1}},
    {SETTING(Notified), kSwitch, {}},
    {SETTING(Tolerance), kDistance, {-1, kInfinity, kNaN}},
    {SETTING(SweptBounds), kDistance, {-1, kInfinity, kNaN}}};
#undef SETTING

}  // namespace

TEST_CASE("A new space is empty, on automatic, and known as ours", "[api]") {
  const BareEnvironment bare;
  const Space space;
  CHECK(dSpaceIsParallelSAP(space) == 1);
  CHECK(dSpaceGetNumGeoms(space) == 0);
  CHECK(dGeomIsSpace(space.geom()));
  CHECK(dSpaceGetClass(space) == dSweepAndPruneSpaceClass);
  CHECK(dSpaceGetCleanup(space) == 1);
  CHECK(dSpaceGetSublevel(space) == 0);
  for (const Setting& setting : kSettings) CHECK(setting.get(space) == 0);  // for some, Auto
  // All statistics are zero before the first collide.
  const dParallelSAPStats stats = statsOf(space), none = {};
  CHECK(std::memcmp(&stats, &none, offsetof(dParallelSAPStats, memory_bytes)) == 0);
  CHECK(collide(space).empty());
}

TEST_CASE("Settings are answered as they were set, and stay where a value is an error", "[api]") {
  const Space space;
  for (const Setting& setting : kSettings) {
    INFO(setting.name);
    for (const auto& [value, becomes] : setting.values) {
      setting.set(space, value);
      CHECK(setting.get(space) == becomes);
    }
    for (const dReal error : setting.errors) {
      CHECK_THROWS_AS(setting.set(space, error), OdeAssertion);
      CHECK(setting.get(space) == 0);
    }
  }
  dSpaceSetSublevel(space, 3);
  CHECK(dSpaceGetSublevel(space) == 3);
}

TEST_CASE("A back end or method is taken with 1, or refused with 0 and nothing changed", "[api]") {
  const Space space;
  const struct {
    int (*set)(dSpaceID, int);
    int (*get)(dSpaceID);
    int last, may_be_missing;
  } settings[] = {
      {dParallelSAPSpaceSetMethod, dParallelSAPSpaceGetMethod, dParallelSAPMethodAxisLists, -1},
      {dParallelSAPSpaceSetBackend, dParallelSAPSpaceGetBackend, dParallelSAPBackendCUDA,
       dParallelSAPBackendCUDA}};
  for (const auto& [set, get, last, may_be_missing] : settings)
    for (const int start : {0, 1})
      for (int value = -1; value <= 99; ++value) {
        REQUIRE(set(space, start) == 1);
        int answer = 0;
        try {
          answer = set(space, value);
        } catch (const OdeAssertion&) {  // no such thing: an assertion in some builds
        }
        CAPTURE(start, value, answer);
        const bool exists = value >= 0 && value <= last;
        CHECK((answer == exists || (answer == 0 && value == may_be_missing)));
        CHECK(get(space) == (answer ? value : start));
      }
}

TEST_CASE("Statistics fill the struct that the program was compiled with, whatever its size",
          "[api]") {
  const Space space;
  World world(space, denseCube(300, 1));
  collide(space);
  const dParallelSAPStats now = statsOf(space);
  const auto bytesOf = [](const dParallelSAPStats& stats) {
    const char* const first = reinterpret_cast<const char*>(&stats);
    return std::string(first, first + sizeof stats);
  };
  const std::size_t all = sizeof now, one_field_less = offsetof(dParallelSAPStats, candidates_kept);
  for (const std::size_t size : {std::size_t(0), one_field_less, all, all + 24}) {
    std::string bytes(all + 64, 'x');
    dParallelSAPSpaceGetStatsSized(size, space, reinterpret_cast<dParallelSAPStats*>(&bytes[0]));
    std::string expected = bytesOf(now).substr(0, size);
    expected.resize(size, '\0');  // fields that this library does not know
    CHECK((bytes == expected + std::string(bytes.size() - size, 'x')));
  }
  // The macro and the function of that name, which programs of this version call.
  dParallelSAPStats function;
  (dParallelSAPSpaceGetStats)(space, &function);
  CHECK((bytesOf(function) == bytesOf(now)));
}

TEST_CASE("A program of another precision, or with another ODE, is told so when it makes a space",
          "[api]") {
  const auto message = [](std::size_t real_size, void (*ode)()) {
    try {
      dSpaceDestroy(dParallelSAPSpaceCreateSized(real_size, ode, nullptr));
    } catch (const OdeAssertion& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  constexpr std::size_t other = sizeof(dReal) == sizeof(float) ? sizeof(double) : sizeof(float);
  CHECK(message(sizeof(dReal), dCloseODE) == "none");
  CHECK(message(other, dCloseODE).find("the program is compiled for") == 0);
  CHECK(message(sizeof(dReal), dCleanupODEAllDataForThread).find("an ODE of its own") !=
        std::string::npos);
  dSpaceDestroy((dParallelSAPSpaceCreate)(nullptr));
}

TEST_CASE("Rays and hits pass their size, and sizes of no version are errors", "[api]") {
  const Space space;
  dCreateSphere(space, 1);
  const dParallelSAPRay ray = {{0, 0, 5, 0}, {0, 0, -1, 0}, 10, 0, 0, nullptr};
  dParallelSAPRayHit hit = {};
  constexpr std::size_t of_ray = sizeof ray, of_hit = sizeof hit;
  for (const std::size_t less_or_more : {-sizeof(void*), sizeof(void*)}) {
    CHECK_THROWS_AS(
        dParallelSAPSpaceRaysSized(of_ray + 2 * less_or_more, of_hit, space, &ray, 1, 0, &hit),
        OdeAssertion);
    CHECK_THROWS_AS(dParallelSAPSpaceRayHitsSized(of_ray, of_hit + less_or_more, space, &ray, 1, 0,
                                                  nullptr, nullptr),
                    OdeAssertion);
  }
  CHECK(dParallelSAPSpaceRaysSized(of_ray, of_hit, space, &ray, 1, 0, &hit) == 1);
  CHECK(hit.distance == 4);
  // The macros, with commas in an argument, and the functions of these names.
  const auto nothing = [](void*, std::size_t, const dParallelSAPRayHit*, std::size_t) {};
  CHECK(dParallelSAPSpaceRays(space, std::array<dParallelSAPRay, 2>{ray, ray}.data(), 2, 0,
                              std::array<dParallelSAPRayHit, 2>{hit, hit}.data()) == 2);
  CHECK(dParallelSAPSpaceRayHits(space, &ray, 1, 0, nullptr, nothing) == 1);
  // Version 0.1's rays.
  struct OldRay {
    dVector3 origin, direction;
    dReal length;
    unsigned long category_bits, collide_bits;
  } old_rays[3] = {{{9, 0, 5, 0}, {0, 0, -1, 0}, 10, 0, 0},
                   {{0, 0, 7, 0}, {0, 0, -1, 0}, 10, 0, 0},
                   {{0, 0, 4, 0}, {0, 0, -1, 0}, 10, 0, 0}};
  const auto* const old = reinterpret_cast<const dParallelSAPRay*>(old_rays);
  dParallelSAPRayHit hits_of_old[3] = {};
  CHECK(dParallelSAPSpaceRaysSized(sizeof(OldRay), of_hit, space, old, 3, 0, hits_of_old) == 2);
  CHECK(hits_of_old[1].distance == 6);
  CHECK((dParallelSAPSpaceRays)(space, old, 3, 0, hits_of_old) == 2);
  CHECK(hits_of_old[2].distance == 3);
  const auto count = [](void* hits, std::size_t, const dParallelSAPRayHit*, std::size_t more) {
    *static_cast<std::size_t*>(hits) += more;
  };
  std::size_t hits = 0;
  CHECK(dParallelSAPSpaceRayHits(space, &ray, 1, 0, &hits, count) == 1);
  CHECK((dParallelSAPSpaceRayHits)(space, old, 3, 0, &hits, count) == 2);
  CHECK(hits == 3);
}

TEST_CASE("Callbacks are taken from a struct of any size; fields that are not known are errors",
          "[api]") {
  const Space space;
  dCreateSphere(space, 1), dCreateSphere(space, 1);
  struct Newer {
    dParallelSAPContactCallbacks known;
    void* unknown;
  };
  static int reported, flagged;
  const auto collideWith = [&](std::size_t size, const dParallelSAPContactCallbacks* callbacks) {
    reported = flagged = 0;
    dParallelSAPSpaceCollideContactsSized(size, space, nullptr, 4, callbacks);
  };
  Newer newer = {{[](void*, dGeomID, dGeomID, const dContactGeom*, int) { ++reported; },
                  [](void*, dGeomID, dGeomID) { return ++flagged; }, nullptr, nullptr},
                 nullptr};
  for (const std::size_t size :
       {sizeof newer.known, offsetof(dParallelSAPContactCallbacks, reduce), sizeof newer}) {
    collideWith(size, &newer.known);
    CHECK(reported == 1);
    CHECK(flagged == 1);
  }
  // A program whose struct had but the first field.
  collideWith(offsetof(dParallelSAPContactCallbacks, flags), &newer.known);
  CHECK(reported == 1);
  CHECK(flagged == 0);
  CHECK_THROWS_AS(collideWith(0, &newer.known), OdeAssertion);
  newer.unknown = &newer;
  CHECK_THROWS_AS(collideWith(sizeof newer, &newer.known), OdeAssertion);
  reported = flagged = 0;
  (dParallelSAPSpaceCollideContacts)(space, nullptr, 4, &newer.known);
  CHECK(reported == 1);
  CHECK(flagged == 1);
}

TEST_CASE("Axis lists that would not fit give way to the sweep, with one message", "[api]") {
  const BareEnvironment bare;
  const Variable limit("ODE_PARALLEL_SAP_AXIS_LISTS_MB", "1");
  const Space space;
  REQUIRE(dParallelSAPSpaceSetMethod(space, dParallelSAPMethodAxisLists) == 1);
  World world(space, denseCube(600, 1));  // some 40,000 pairs an axis
  const Messages messages;
  CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
  CHECK(statsOf(space).method == dParallelSAPMethodAxisLists);
  CHECK(messages.all().empty());
  world.addBoxes(denseCube(600, 2));
  for (int frame = 0; frame < 3; ++frame) {
    CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
    CHECK(statsOf(space).method == dParallelSAPMethodSweep);
    CHECK(statsOf(space).memory_bytes < (2u << 20));
  }
  CHECK(messages.all().size() == 1);
  // What fits again is done as asked.
  for (std::size_t i = 0; i < 600; ++i) dGeomDisable(world.geoms()[i]);
  CHECK(difference(collide(space), expectedPairs(world.geoms())) == "");
  CHECK(statsOf(space).method == dParallelSAPMethodAxisLists);
  CHECK(messages.all().size() == 1);
}

TEST_CASE("Wrong arguments are assertions", "[api]") {
  const Space space;
  const dSpaceID stock = dHashSpaceCreate(nullptr);
  const dSpaceID sweep = dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
  dParallelSAPStats stats;
  const dParallelSAPPairEvent* events;
  const unsigned* numbers;
  unsigned number;
  dParallelSAPRayHit hit;
  const dGeomID ball = dCreateSphere(nullptr, 1);
  // Each with its name, which the message is to tell.
#define CALL(function, arguments)                                \
  {                                                              \
#function, [&](dSpaceID wrong) { (void)function arguments; } \
  }
  const std::pair<const char*, std::function<void(dSpaceID)>> calls[] = {
      CALL(dParallelSAPSpaceSetTrace, (wrong, nullptr, 1)),
      CALL(dParallelSAPSpaceGetTrace, (wrong)),
      CALL(dParallelSAPSpaceCollideContacts, (wrong, nullptr, 8, nullptr)),
      CALL(dParallelSAPSpaceCollidePairs, (wrong, nullptr, 0, nullptr)),
      CALL(dParallelSAPSpaceRays, (wrong, nullptr, 0, 0, &hit)),
      CALL(dParallelSAPSpaceRayHits, (wrong, nullptr, 0, 0, nullptr, nullptr)),
      CALL(dParallelSAPSpaceOverlaps, (wrong, nullptr, 0, 0, 0, nullptr, nullptr)),
      CALL(dParallelSAPSpaceSetQueryFilter, (wrong, nullptr, nullptr)),
      CALL(dParallelSAPSpaceGetBegunPairs, (wrong, &events)),
      CALL(dParallelSAPSpaceGetEndedPairs, (wrong, &events)),
      CALL(dParallelSAPSpaceGetBegunTouches, (wrong, &events)),
      CALL(dParallelSAPSpaceGetEndedTouches, (wrong, &events)),
      CALL(dParallelSAPSpaceGetPairNumbers, (wrong, &numbers)),
      CALL(dParallelSAPSpaceFindPair, (wrong, ball, ball, &number)),
      CALL(dParallelSAPSpaceNotify, (wrong, nullptr)),
      CALL(dParallelSAPSpaceIsFast, (wrong, ball)),
      CALL(dParallelSAPSpaceGetStats, (wrong, &stats))};
#undef CALL
  const auto messageOf = [](auto call) -> std::string {
    try {
      call();
    } catch (const OdeAssertion& assertion) {
      return assertion.what();
    }
    return "none";
  };
  CHECK(messageOf([&] { dParallelSAPSpaceCreate(reinterpret_cast<dSpaceID>(ball)); }) ==
        "parent is not a space in dParallelSAPSpaceCreate()");
  CHECK(messageOf([] { dParallelSAPClassHasNoAABBTest(dBoxClass); }) ==
        "not a class of dCreateGeomClass in dParallelSAPClassHasNoAABBTest()");
  for (const dSpaceID wrong : {dSpaceID(nullptr), stock, sweep}) {
    const auto isRefused = [&](const std::string& name, auto call) {
      CHECK(messageOf(call) == "argument not a parallel SAP space in " + name + "()");
    };
    for (const auto& [name, call] : calls) isRefused(name, [&, &call = call] { call(wrong); });
    for (const Setting& setting : kSettings) {
      isRefused("dParallelSAPSpaceSet" + setting.name, [&] { setting.set(wrong, 1); });
      isRefused("dParallelSAPSpaceGet" + setting.name, [&] { setting.get(wrong); });
    }
  }
  const auto namesIt = [&](const char* name, auto call) {
    const std::string message = messageOf(call), end = std::string(" in ") + name + "()";
    INFO(message);
    CHECK((message.size() > end.size() &&
           message.compare(message.size() - end.size(), end.size(), end) == 0));
  };
  namesIt("dParallelSAPSpaceIsFast", [&] { dParallelSAPSpaceIsFast(space, ball); });
  dParallelSAPRay ray = {};
  namesIt("dParallelSAPSpaceRays", [&] { dParallelSAPSpaceRays(space, nullptr, 1, 0, &hit); });
  namesIt("dParallelSAPSpaceRays", [&] { dParallelSAPSpaceRays(space, &ray, 1, -1, &hit); });
  namesIt("dParallelSAPSpaceRays", [&] { dParallelSAPSpaceRays(space, &ray, 1, 0, nullptr); });
  for (const int flags : {-1, 0})
    namesIt("dParallelSAPSpaceRayHits",
            [&] { dParallelSAPSpaceRayHits(space, &ray, 1, flags, nullptr, nullptr); });
  dParallelSAPProbe probe = {ball, nullptr, 0};
  const auto overlap = [](void*, std::size_t, dGeomID, const dContactGeom*, int) {};
  const auto refusesOverlaps = [&](dParallelSAPProbe* probes, std::size_t size, int flags,
                                   dParallelSAPOverlapCallback* callback) {
    namesIt("dParallelSAPSpaceOverlaps",
            [&] { dParallelSAPSpaceOverlaps(space, probes, 1, size, flags, nullptr, callback); });
  };
  refusesOverlaps(nullptr, sizeof probe, 1, nullptr);
  refusesOverlaps(&probe, sizeof probe - 1, 1, nullptr);
  refusesOverlaps(&probe, sizeof probe, 0x20000, nullptr);
  refusesOverlaps(&probe, sizeof probe, dParallelSAPOverlapAny, overlap);
  for (const dGeomID wrong : {dGeomID(nullptr), asGeom(stock)}) {
    probe.geom = wrong;
    refusesOverlaps(&probe, sizeof probe, 1, overlap);
  }
  namesIt("dParallelSAPSpaceCollidePairs",
          [&] { dParallelSAPSpaceCollidePairs(space, nullptr, 2, nullptr); });
  dContactGeom contact;
  const auto sweep_it = [&](dGeomID geom, dReal step, int flags, int skip = sizeof(dContactGeom)) {
    namesIt("dParallelSAPCollideSwept",
            [=, &contact] { dParallelSAPCollideSwept(geom, ball, step, flags, &contact, skip); });
  };
  sweep_it(nullptr, 1, 1);
  sweep_it(space.geom(), 1, 1);
  sweep_it(ball, -1, 1);
  sweep_it(ball, std::numeric_limits<dReal>::quiet_NaN(), 1);
  sweep_it(ball, 1, 0);
  sweep_it(ball, 1, 1, sizeof(dContactGeom) - 1);
  for (const std::pair<int, int>& wrong : {std::pair(1, 1), {-1, 4}, {1, -1}}) {
    const int count = wrong.first, most = wrong.second;
    dContactGeom* const contacts = most == 1 ? nullptr : &contact;
    namesIt("dParallelSAPKeepDeepest", [&] { dParallelSAPKeepDeepest(contacts, count, most); });
    namesIt("dParallelSAPKeepSpread", [&] { dParallelSAPKeepSpread(contacts, count, most); });
  }
  dGeomDestroy(ball);
  // Flags for no contact, and such as there are none, in a small scene and a large one.
  const auto noFlags = [](void*, dGeomID, dGeomID) { return 0; };
  const auto wrongFlags = [](void*, dGeomID, dGeomID) { return -1; };
  const dParallelSAPContactCallbacks none = {}, plain = {recordContacts, nullptr, nullptr, nullptr},
                                     without_flags = {recordContacts, noFlags, nullptr, nullptr},
                                     with_wrong = {recordContacts, wrongFlags, nullptr, nullptr};
  Contacts contacts;
  const auto collideWith = [&](const dParallelSAPContactCallbacks* callbacks, int flags) {
    dParallelSAPSpaceCollideContacts(space, &contacts, flags, callbacks);
  };
  for (const std::size_t n : {2, 1000}) {
    World world(space, onePlace(2, 1));
    world.addBoxes(denseCube(n, 1));
    CAPTURE(n);
    const auto refuses = [&](const dParallelSAPContactCallbacks* callbacks, int flags) {
      namesIt("dParallelSAPSpaceCollideContacts", [&] { collideWith(callbacks, flags); });
    };
    refuses(nullptr, 8);
    refuses(&none, 8);
    for (const int flags : {0, static_cast<int>(CONTACTS_UNIMPORTANT), 8 | 0x10000000, -1})
      refuses(&plain, flags);
    refuses(&with_wrong, 8);
    collideWith(&without_flags, 0);
  }
  CHECK_THROWS_AS(dParallelSAPAddPair(nullptr, nullptr, nullptr), OdeAssertion);
  CHECK(dSpaceIsParallelSAP(stock) == 0);
  CHECK_THROWS_AS(dSpaceIsParallelSAP(nullptr), OdeAssertion);
  CHECK_THROWS_AS(dParallelSAPSpaceGetStats(space, nullptr), OdeAssertion);
  CHECK_THROWS_AS(dParallelSAPSpaceIsFast(space, nullptr), OdeAssertion);
  CHECK_THROWS_AS(dSpaceCollide(space, nullptr, nullptr), OdeAssertion);
  CHECK_THROWS_AS(dSpaceAdd(space, nullptr), OdeAssertion);
  if (odeHasAssertions()) {
    CHECK_THROWS_AS(dSpaceGetGeom(space, 0), OdeAssertion);
    CHECK_THROWS_AS(dSpaceGetGeom(space, -1), OdeAssertion);
    CHECK_THROWS_AS(dHashSpaceSetLevels(space, -2, 8), OdeAssertion);
  } else {
    WARN("SKIPPED: indexes out of range, levels; this ODE was built without assertions");
  }
  dSpaceDestroy(stock);
  dSpaceDestroy(sweep);
}

TEST_CASE("A geom is in one space at most, and removed only from where it is", "[api]") {
  const Space space, other;
  const dGeomID inside = dCreateSphere(space, 1), outside = dCreateSphere(nullptr, 1);
  CHECK(dSpaceQuery(space, inside) == 1);
  CHECK(dSpaceQuery(other, inside) == 0);
  CHECK_THROWS_AS(dSpaceAdd(space, inside), OdeAssertion);
  CHECK_THROWS_AS(dSpaceAdd(other, inside), OdeAssertion);
  CHECK_THROWS_AS(dSpaceRemove(other, inside), OdeAssertion);
  CHECK_THROWS_AS(dSpaceRemove(space, outside), OdeAssertion);
  CHECK(dSpaceGetNumGeoms(space) == 1);
  CHECK(dSpaceGetNumGeoms(other) == 0);
  CHECK(dSpaceGetGeom(space, 0) == inside);
  dGeomDestroy(outside);
}
