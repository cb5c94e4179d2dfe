// dSpaceCollide2 of two large spaces: what is found ahead of ODE's walk through the smaller one is
// what each query would have found by itself, whatever happens in between. Teams are of little
// work, so built from the library's objects.
#include <ode_parallel_sap/parallel_sap_space.h>
#include <omp.h>

#include <limits>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/teams.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

constexpr std::size_t kProbeNumber = 1000000;
constexpr dReal kNaN = std::numeric_limits<dReal>::quiet_NaN();

Boxes scattered(std::size_t n, std::uint64_t seed) {
  Boxes boxes = denseCube(n, seed);
  Random random(seed);
  for (Box& box : boxes)
    if (random.chance(0.02)) box.high[random.below(3)] += random.between(1, 20);
  return boxes;
}

// A space that is asked about many geoms: those of another space, or, in the twin, of none, so that
// nobody can know which one comes next.
class Walk {
 public:
  // What may happen: first what leaves what was found of use; the space asked is not locked for the
  // last two only.
  static constexpr std::size_t asking = 6, throwing = 7, moving = 8, all_events = 10;

  Walk(bool in_space, std::uint64_t seed) : random_(seed), world_(asked_) {
    if (in_space) list_ = dParallelSAPSpaceCreate(nullptr);
    world_.addBoxes(scattered(600, seed));
    for (const Box& box : scattered(500, seed + 1)) addProbe(box);
    for (std::size_t i = 0; i < 300; ++i) world_.giveBody(world_.geoms()[i]);
    shared_body_ = world_.bodies()[0];
  }
  ~Walk() {
    for (const dGeomID probe : probes_)
      if (probe) dGeomDestroy(probe);
    if (list_) dSpaceDestroy(list_);
  }
  Walk(const Walk&) = delete;
  Walk& operator=(const Walk&) = delete;

  dSpaceID asked() const { return asked_; }
  Random& random() { return random_; }

  // What is reported, with something of `events` done after one pair in `every`.
  Pairs go(std::size_t events, std::size_t every) {
    seen_.clear();
    events_ = events;
    every_ = every;
    try {
      if (list_)
        dSpaceCollide2(asGeom(asked_), asGeom(list_), this, tell);
      else
        for (at_ = 0; at_ < probes_.size(); ++at_)
          if (probes_[at_]) dSpaceCollide2(asGeom(asked_), probes_[at_], this, tell);
    } catch (int) {
      seen_.emplace_back(0, 0);
    }
    return seen_;
  }
  // The same by queries of the program's own, one after the other. What happens, happens between
  // them.
  Pairs goOneByOne(std::size_t every) {
    seen_.clear();
    for (std::size_t i = 0; i < probes_.size(); ++i) {
      if (probes_[i]) dSpaceCollide2(asGeom(asked_), probes_[i], &seen_, record);
      const std::size_t event = random_.below(all_events);
      if (random_.below(every) == 0 && event != throwing) happen(event, i);
    }
    return seen_;
  }
  // What is owed as long as nothing happens. Asks for the AABBs of all.
  Pairs expected() const {
    Pairs expected;
    for (const dGeomID probe : probes_)
      for (const dGeomID own : world_.geoms())
        if (takesPart(probe) && takesPart(own) && mayTouch(own, probe))
          expected.emplace_back(number(own), number(probe));
    return expected;
  }
  void moveAll() {
    world_.jitter(0.2, random_.bits());
    for (const dGeomID probe : probes_)
      if (probe) moveSome(probe, 0.2);
  }

 private:
  void addProbe(const Box& box) {
    const dGeomID probe =
        random_.chance(0.1) ? createUserBox(list_, userBoundsOf(box))
                            : dCreateBox(list_, static_cast<dReal>(box.high[0] - box.low[0]), 1, 1);
    if (dGeomGetClass(probe) == dBoxClass)
      dGeomSetPosition(probe, static_cast<dReal>(box.low[0]), static_cast<dReal>(box.low[1]),
                       static_cast<dReal>(box.low[2]));
    setNumber(probe, kProbeNumber + probes_.size());
    probes_.push_back(probe);
  }
  Bounds userBoundsOf(const Box& box) {
    Bounds bounds;
    if (random_.chance(0.1)) return {kNaN, kNaN, kNaN, kNaN, kNaN, kNaN};
    for (int axis = 0; axis < 3; ++axis) {
      bounds[2 * axis] = static_cast<dReal>(box.low[axis]);
      bounds[2 * axis + 1] = static_cast<dReal>(box.high[axis]);
    }
    return bounds;
  }
  void moveSome(dGeomID geom, double reach) {
    if (dGeomGetClass(geom) != dBoxClass || dGeomGetBody(geom)) return;
    const dReal* const at = dGeomGetPosition(geom);
    dGeomSetPosition(geom, at[0] + static_cast<dReal>(random_.between(-reach, reach)), at[1],
                     at[2]);
  }

  static void tell(void* data, dGeomID first, dGeomID second) {
    Walk& walk = *static_cast<Walk*>(data);
    record(&walk.seen_, first, second);
    if (walk.random_.below(walk.every_) == 0 && walk.events_)
      walk.happen(walk.random_.below(walk.events_), number(second) - kProbeNumber);
  }
  // To a geom of the space, or to a probe that was asked about or will be; not to the one that is.
  void happen(std::size_t event, std::size_t current) {
    const dGeomID own = world_.geoms()[random_.below(world_.geoms().size())];
    const std::size_t other = random_.below(probes_.size());
    const dGeomID probe = other == current ? nullptr : probes_[other];
    if (event == 0) (dGeomIsEnabled(own) ? dGeomDisable : dGeomEnable)(own);
    if (event == throwing) throw 1;
    if (event == moving && dGeomGetBody(own)) moveBody(dGeomGetBody(own));
    if (event == moving + 1) dGeomSetCollideBits(own, random_.below(4));
    if (!probe) return;
    if (event == 1) moveSome(probe, 2);
    if (event == 2) dGeomSetCollideBits(probe, random_.below(4));
    if (event == 3) dGeomSetBody(probe, dGeomGetBody(probe) ? nullptr : shared_body_);
    if (event == 4 && dGeomGetClass(probe) == dBoxClass) dGeomBoxSetLengths(probe, 3, 1, 1);
    if (event == 5) {
      dGeomDestroy(probe);
      probes_[other] = nullptr;
    }
    if (event == asking) askAgain(probe);
  }
  void moveBody(dBodyID body) {
    const dReal* const at = dBodyGetPosition(body);
    dBodySetPosition(body, at[0] + static_cast<dReal>(random_.between(-1, 1)), at[1], at[2]);
  }
  void askAgain(dGeomID probe) {
    const Pairs inner = collide2(asked_, probe);
    seen_.insert(seen_.end(), inner.begin(), inner.end());
  }

  Random random_;
  const Space asked_;
  World world_;
  dSpaceID list_ = nullptr;
  std::vector<dGeomID> probes_;
  dBodyID shared_body_;
  Pairs seen_;
  std::size_t events_ = 0, every_ = 1, at_ = 0;
};

const int kThreads[] = {1, 2, 3, 7, 16};

}  // namespace

TEST_CASE("Two large spaces report what the oracle expects, in one order on any number of threads",
          "[queries]") {
  const ScopedGrain grain(1);
  const std::uint64_t seed = seedOr(191);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  for (const int threads : kThreads) {
    Walk walk(true, seed);
    dParallelSAPSpaceSetNumThreads(walk.asked(), threads);
    Walk twin(false, seed);
    for (int frame = 0; frame < 4; ++frame) {
      INFO(threads << " threads, frame " << frame);
      const Pairs got = walk.go(0, 1);
      REQUIRE(got.size() > 500);
      REQUIRE(difference(got, twin.go(0, 1)) == "");
      REQUIRE(difference(got, walk.expected()) == "");
      walk.moveAll();
      twin.moveAll();
    }
  }
}

TEST_CASE("What a callback does to either space between two queries shows in the next one",
          "[queries]") {
  const ScopedGrain grain(1);
  const int runs = scaled(10);
  for (int run = 0; run < runs; ++run) {
    const std::uint64_t seed = seedOr(192, run);
    INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    Walk walk(true, seed), twin(false, seed);
    dParallelSAPSpaceSetNumThreads(walk.asked(), kThreads[run % 5]);
    for (int frame = 0; frame < 6; ++frame) {
      const std::size_t events = frame % 2 ? Walk::moving : Walk::asking,
                        every = frame % 2 ? 200 : 10;
      CAPTURE(frame);
      REQUIRE(difference(walk.go(events, every), twin.go(events, every)) == "");
      walk.moveAll();
      twin.moveAll();
    }
  }
}

TEST_CASE("What a program does between two queries of its own shows in the next one", "[queries]") {
  const ScopedGrain grain(1);
  const int runs = scaled(10);
  for (int run = 0; run < runs; ++run) {
    const std::uint64_t seed = seedOr(193, run);
    INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    Walk walk(true, seed), twin(false, seed);
    dParallelSAPSpaceSetNumThreads(walk.asked(), 2);
    for (int frame = 0; frame < 6; ++frame) {
      CAPTURE(frame);
      const std::size_t every = frame % 2 ? 100 : 10;
      REQUIRE(difference(walk.goOneByOne(every), twin.goOneByOne(every)) == "");
    }
  }
}

// Two batches are done alone to know what they take; the next one is a team's.
TEST_CASE("A space that never collides has threads without being told how many", "[queries]") {
  const ScopedGrain grain(1);
  const int before = omp_get_max_threads();
  omp_set_num_threads(3);
  {
    Walk walk(true, seedOr(194));
    std::vector<dParallelSAPRay> rays(100);
    for (std::size_t i = 0; i < rays.size(); ++i)
      rays[i] = {{dReal(i % 10), dReal(i / 10), -1, 0}, {0, 0, 1, 0}, 10, ~0ul, ~0ul};
    std::vector<dParallelSAPRayHit> hits(rays.size());
    const auto shared = timesShared();
    for (int frame = 0; frame < 3; ++frame) {
      walk.go(0, 1);
      dParallelSAPSpaceRays(walk.asked(), rays.data(), rays.size(), 0, hits.data());
    }
    CHECK(timesShared().at("queries ahead: searches") > shared.at("queries ahead: searches"));
    CHECK(timesShared().at("rays: rays") > shared.at("rays: rays"));
  }
  omp_set_num_threads(before);
}
