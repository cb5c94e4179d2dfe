// Batches of rays and of probes: the answers of a loop over dCollide, bit for bit, whichever thread
// finds them.
#include <array>
#include <chrono>
#include <type_traits>

#include "support/contact_scene.h"
#include "support/overlap_oracle.h"
#include "support/ray_oracle.h"
#include "support/tests.h"

using namespace sap_test;

namespace {

const int kTeams[] = {1, 2, 3, 7, 16};

}  // namespace

TEMPLATE_TEST_CASE("Meshes, heightfields and users' classes are met alike by any number of threads",
                   "[rays][overlaps]", RayBatch, ProbeBatch) {
  const std::uint64_t seed = seedOr(511);
  const Space space, other;
  ContactScene scene(space), probing(other);
  // ODE's collider of a ray and an endless heightfield takes memory for the whole of the ray.
  std::vector<Kind> kinds;
  for (int kind = 0; kind < static_cast<int>(Kind::FixedHeightfield); ++kind)
    kinds.push_back(static_cast<Kind>(kind));
  if constexpr (std::is_same_v<TestType, ProbeBatch>) kinds.push_back(Kind::CalledHeightfield);
  scene.fill(kinds, 250, seed);
  scene.add(Kind::Plane, 1, seed);
  Random random(seed);
  std::vector<dGeomID> geoms;
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) geoms.push_back(dSpaceGetGeom(space, i));
  TestType batch(80, random);  // enough for all threads
  if constexpr (std::is_same_v<TestType, ProbeBatch>) {
    probing.fill(kinds, 80, seed + 1);
    batch.probes.clear();
    for (int i = 0; i < dSpaceGetNumGeoms(other); ++i) {
      const dBodyID some = dGeomGetBody(geoms[static_cast<std::size_t>(3 * i)]);
      batch.probes.push_back({dSpaceGetGeom(other, i), i % 3 ? nullptr : some, 0});
    }
  }
  for (int frame = 0; frame < 4; ++frame) {
    scene.move(random.bits());
    if constexpr (std::is_same_v<TestType, RayBatch>)
      batch.moveTo(geoms);
    else
      probing.move(random.bits());
    const int flags = batch.someFlags();
    INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
    userCodeKeptToThisThread();
    const auto first = batch.ask(space, flags);  // before the oracle asks for bounds
    const auto owed = batch.owed(space, geoms, flags);
    REQUIRE(difference(first, owed) == "");
    for (const int threads : kTeams) {
      INFO(threads << " threads, flags " << flags);
      dParallelSAPSpaceSetNumThreads(space, threads);
      REQUIRE(difference(batch.ask(space, flags), owed) == "");
    }
    CHECK(TestType::meeting(owed) > 30);
    CHECK(userCodeKeptToThisThread());
    CHECK(userCodeCalls() > 0);
  }
  if constexpr (std::is_same_v<TestType, ProbeBatch>) {
    dParallelSAPSpaceSetNumThreads(space, 1);
    std::vector<std::size_t> calls;  // of users' colliders, fewer where the first overlap will do
    for (const int flags : {0, int{dParallelSAPOverlapAny}}) {
      dParallelSAPSpaceOverlaps(space, batch.probes.data(), batch.probes.size(),
                                sizeof batch.probes[0], flags, nullptr, nullptr);
      calls.push_back(userCodeCalls());
    }
    CHECK(calls[1] < calls[0]);
  }
}

TEST_CASE("Queries do not go through all geoms of a large space within the space",
          "[rays][overlaps]") {
  // The least times of several, for each ray or probe, with as many geoms in the space itself.
  const auto times = [](bool within) {
    const Space space;
    const dSpaceID around = within ? dParallelSAPSpaceCreate(space) : dSpaceID(space);
    for (int i = 0; i < 20000; ++i)
      dGeomSetPosition(dCreateSphere(around, 1), real(3 * (i % 100)), real(3 * (i / 100)), 0);
    dParallelSAPSpaceSetNumThreads(space, 1);
    const Rays rays(500, rayOf({30, 90, 5}, {0.01, 0.02, -1}, 10));
    Probes probes(500, {dCreateSphere(nullptr, 1), nullptr, 0});
    using Clock = std::chrono::steady_clock;
    std::array<Clock::duration, 2> least = {std::chrono::hours(1), std::chrono::hours(1)};
    for (int i = 0; i < 5; ++i) {
      const Clock::time_point begin = Clock::now();
      REQUIRE(RayBatch::meeting({nearestHits(space, rays, 0), {}}) == rays.size());
      const Clock::time_point middle = Clock::now();
      REQUIRE(dParallelSAPSpaceOverlaps(space, probes.data(), probes.size(), sizeof probes[0], 1,
                                        nullptr, nullptr) == probes.size());
      least = {std::min(least[0], middle - begin), std::min(least[1], Clock::now() - middle)};
    }
    dGeomDestroy(probes[0].geom);
    return least;
  };
  const auto apart = times(true), together = times(false);
  CHECK(apart[0] < 6 * together[0]);
  CHECK(apart[1] < 6 * together[1]);
}

TEST_CASE("A probe with a bound that is no number touches nothing, with one message",
          "[overlaps]") {
  const Space space;
  for (int i = 0; i < 300; ++i) dCreateSphere(space, 1);
  dCreatePlane(space, 1, 1, 1, 0);
  const dGeomID lost = dCreateBox(nullptr, 1, 1, 1), ball = dCreateSphere(nullptr, 1);
  dGeomSetPosition(lost, 0, std::numeric_limits<dReal>::quiet_NaN(), 0);
  const dGeomID point = dCreateSphere(nullptr, 0), last = dCreateSphere(nullptr, 1);
  Probes probes = {{ball, nullptr, 9}, {lost, nullptr, 9}, {point, nullptr, 9}, {last, nullptr, 9}};
  const std::size_t owed = owedOverlaps(space, {probes[2]}, 1).touched[0];
  const Messages messages;
  for (int i = 0; i < 9; ++i)  // without trees and with them
    CHECK(dParallelSAPSpaceOverlaps(space, probes.data(), 4, sizeof probes[0], 1, nullptr,
                                    nullptr) == 2 * 301 + owed);
  CHECK(probes[0].touched == 301);
  CHECK(probes[1].touched == 0);
  CHECK(probes[2].touched == owed);
  CHECK(messages.all().size() <= 1);
  for (const dGeomID geom : {lost, ball, point, last}) dGeomDestroy(geom);
}

TEST_CASE("The message of a probe that is no number comes on any number of threads", "[overlaps]") {
  const dGeomID lost = dCreateSphere(nullptr, 1);
  dGeomSetPosition(lost, 0, kNaN, 0);
  for (const int threads : {1, 3}) {
    const Space space;
    dCreateSphere(space, 1);
    dParallelSAPSpaceSetNumThreads(space, threads);
    Probes probes(80, {lost, nullptr, 0});
    const Messages messages;
    CHECK(dParallelSAPSpaceOverlaps(space, probes.data(), probes.size(), sizeof probes[0], 1,
                                    nullptr, nullptr) == 0);
    CHECK(messages.all().size() == 1);
  }
  dGeomDestroy(lost);
}
