// The filter of rays and probes: what a loop over dCollide finds that asks it, too.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <new>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/nested_scene.h"
#include "support/overlap_oracle.h"
#include "support/random.h"
#include "support/ray_oracle.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

const int kTeams[] = {1, 7};

// Of each query and geom something else.
bool mayMeet(std::size_t query, dGeomID geom) {
  dReal bounds[6];
  dGeomGetAABB(geom, bounds);
  std::uint32_t bits;
  std::memcpy(&bits, &bounds[0], sizeof bits);
  return ((bits >> 7) + query + static_cast<std::size_t>(dGeomGetClass(geom))) % 3 != 0;
}

// Rays and probes, and all that a filter is told of them.
struct Queries {
  Rays rays;
  Probes probes;
  std::atomic<std::size_t> spaces{0}, beside{0}, calls{0};

  Queries(const std::vector<dGeomID>& geoms, std::size_t n, Random& random)
      : rays(raysAt(geoms, n, random)) {
    while (probes.size() < n) {
      probes.push_back({dCreateSphere(nullptr, 1), nullptr, 0});
      dReal bounds[6];
      dGeomGetAABB(geoms[random.below(geoms.size())], bounds);
      dGeomSetPosition(probes.back().geom, bounds[0], bounds[2], bounds[4]);
      dGeomGetAABB(probes.back().geom, bounds);
    }
  }
  ~Queries() {
    for (const dParallelSAPProbe& probe : probes) dGeomDestroy(probe.geom);
  }

  void note(dGeomID geom, const dReal (&of_query)[6]) {
    ++calls;
    spaces += dGeomIsSpace(geom) != 0;
    dReal bounds[6];
    dGeomGetAABB(geom, bounds);
    for (int axis = 0; axis < 3; ++axis)
      beside += !(bounds[2 * axis] <= of_query[2 * axis + 1] &&
                  of_query[2 * axis] <= bounds[2 * axis + 1]);
  }
  static int filterRays(void* data, std::size_t query, dGeomID geom) {
    Queries& own = *static_cast<Queries*>(data);
    const dParallelSAPRay& ray = own.rays.at(query);
    dReal bounds[6], square = 0;
    for (const dReal along : ray.direction) square += along * along;
    for (int axis = 0; axis < 3; ++axis) {
      const dReal from = ray.origin[axis],
                  to = from + ray.direction[axis] / std::sqrt(square) * ray.length,
                  slack = dReal(1e-3) * (std::fabs(from) + std::fabs(to) + 1);
      bounds[2 * axis] = std::min(from, to) - slack;
      bounds[2 * axis + 1] = std::max(from, to) + slack;
    }
    own.note(geom, bounds);
    return mayMeet(query, geom);
  }
  static int filterProbes(void* data, std::size_t query, dGeomID geom) {
    Queries& own = *static_cast<Queries*>(data);
    dReal bounds[6];
    dGeomGetAABB(own.probes.at(query).geom, bounds);
    own.note(geom, bounds);
    return mayMeet(query, geom);
  }
};

std::size_t countOverlaps(dSpaceID space, Probes& probes) {
  return dParallelSAPSpaceOverlaps(space, probes.data(), probes.size(), sizeof probes[0], 1,
                                   nullptr, nullptr);
}

}  // namespace

TEST_CASE("Queries meet the geoms that the filter lets pass, at any depth and on any threads",
          "[filters]") {
  const std::uint64_t seed = seedOr(601);
  for (int scene = 0; scene < scaled(3); ++scene) {
    NestedScene nested(seed + static_cast<std::uint64_t>(scene));
    const dSpaceID space = nested.space();
    Random random(seed);
    for (int frame = 0; frame < 4; ++frame) {
      if (frame > 0) nested.change();
      dSpaceClean(space);
      Queries queries(nested.inside(), 60, random);
      (void)nearestHits(space, queries.rays, 0);  // before the oracle asks for bounds
      const OwedRays owed_rays = owedRays(nested.geoms(), queries.rays, 2, mayMeet);
      const std::vector<Contacts> owed = owedOverlaps(space, queries.probes, 2, mayMeet);
      for (const int threads : kTeams) {
        INFO("scene " << scene << ", frame " << frame << ", " << threads
                      << " threads, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        dParallelSAPSpaceSetNumThreads(space, threads);
        dParallelSAPSpaceSetQueryFilter(space, Queries::filterRays, &queries);
        REQUIRE(wrongRays(space, queries.rays, 2, owed_rays) == "");
        dParallelSAPSpaceSetQueryFilter(space, Queries::filterProbes, &queries);
        REQUIRE(wrongOverlaps(space, queries.probes, 2, owed) == "");
        dParallelSAPSpaceSetQueryFilter(space, nullptr, nullptr);
        REQUIRE(wrongRays(space, nested.geoms(), queries.rays, 2) == "");
      }
      CHECK(queries.spaces == 0);
      CHECK(queries.beside == 0);
      CHECK(queries.calls > 500);
    }
  }
}

TEST_CASE("The rays and probes of each of 200 robots pass its own bodies", "[filters]") {
  constexpr std::size_t kRobots = 200, kRays = 24;
  const Space space;
  World world(space);
  std::vector<dGeomID> robots;  // their spaces
  Rays rays;
  Probes probes;
  for (std::size_t robot = 0; robot < kRobots; ++robot) {
    const double x = 2.0 * static_cast<double>(robot % 20),
                 y = 2.0 * static_cast<double>(robot / 20);
    const dSpaceID of = robot % 2 ? dSimpleSpaceCreate(space) : dParallelSAPSpaceCreate(space);
    robots.push_back(world.take(asGeom(of)));
    for (int link = 0; link < 3; ++link) {
      const dBodyID body = dBodyCreate(world.dynamics());
      dBodySetPosition(body, dReal(x + 0.5 * (link - 1)), dReal(y), 0);
      dGeomSetBody(dCreateBox(of, dReal(0.6), dReal(0.5), 1), body);
    }
    for (std::size_t ray = 0; ray < kRays; ++ray) {
      const double turn = 6.2832 * static_cast<double>(ray) / kRays;
      rays.push_back(rayOf({x, y, 0.1}, {std::cos(turn), std::sin(turn), 0}, 3));
    }
    probes.push_back({dCreateSphere(nullptr, dReal(1.3)), nullptr, 0});
    dGeomSetPosition(probes.back().geom, dReal(x), dReal(y), 0);
  }
  // As in the guide: data of a query's robot.
  struct Of {
    const std::vector<dGeomID>& robots;
    std::size_t queries;
    static int passes(void* data, std::size_t query, dGeomID geom) {
      const Of& of = *static_cast<Of*>(data);
      return asGeom(dGeomGetSpace(geom)) != of.robots[query / of.queries];
    }
  } of_ray = {robots, kRays}, of_probe = {robots, 1};
  const auto filterOf = [](Of& of) {
    return [&of](std::size_t query, dGeomID geom) { return Of::passes(&of, query, geom) != 0; };
  };
  dSpaceClean(space);
  const OwedRays owed_rays = owedRays(world.geoms(), rays, 0, filterOf(of_ray));
  const std::vector<Contacts> owed = owedOverlaps(space, probes, 1, filterOf(of_probe));
  for (const int threads : kTeams) {
    dParallelSAPSpaceSetNumThreads(space, threads);
    dParallelSAPSpaceSetQueryFilter(space, Of::passes, &of_ray);
    REQUIRE(wrongRays(space, rays, 0, owed_rays) == "");
    std::size_t others = 0;
    const RayHits hits = nearestHits(space, rays, 0);
    for (const dParallelSAPRayHit& hit : hits) others += hit.geom != nullptr;
    CHECK(others > kRobots);
    dParallelSAPSpaceSetQueryFilter(space, Of::passes, &of_probe);
    REQUIRE(wrongOverlaps(space, probes, 1, owed) == "");
    CHECK(countOverlaps(space, probes) > kRobots);
  }
  for (const dParallelSAPProbe& probe : probes) dGeomDestroy(probe.geom);
}

TEST_CASE("A filter may throw: one exception leaves the call, and nothing is reported",
          "[filters]") {
  const std::uint64_t seed = seedOr(611);
  Random random(seed);
  const Space space;
  World world(space);
  world.addBoxes(denseCube(400, seed));
  Queries queries(world.geoms(), 100, random);
  static std::atomic<int> calls, from, to;
  static bool without_memory;
  const auto throwing = [](void*, std::size_t query, dGeomID geom) -> int {
    const int call = calls++;
    if (call < from || call >= to) return mayMeet(query, geom);
    if (without_memory) throw std::bad_alloc();
    throw call;
  };
  const auto setThrowing = [&](bool of_memory, int first, int last) {
    without_memory = of_memory;
    calls = 0;
    from = first;
    to = last;
  };
  dSpaceClean(space);
  const OwedRays owed_rays = owedRays(world.geoms(), queries.rays, 0, mayMeet);
  const std::vector<Contacts> owed = owedOverlaps(space, queries.probes, 1, mayMeet);
  static std::size_t reported;
  const auto rays = [&] {
    dParallelSAPSpaceRayHits(
        space, queries.rays.data(), queries.rays.size(), 0, nullptr,
        [](void*, std::size_t, const dParallelSAPRayHit*, std::size_t) { ++reported; });
  };
  const auto probes = [&] {
    dParallelSAPSpaceOverlaps(
        space, queries.probes.data(), queries.probes.size(), sizeof queries.probes[0], 1, nullptr,
        [](void*, std::size_t, dGeomID, const dContactGeom*, int) { ++reported; });
  };
  constexpr int kEnd = 1 << 30;
  for (const int threads : kTeams) {
    CAPTURE(threads);
    dParallelSAPSpaceSetNumThreads(space, threads);
    dParallelSAPSpaceSetQueryFilter(space, throwing, nullptr);
    for (const int last : {51, kEnd}) {
      reported = 0;
      setThrowing(false, 50, last);
      CHECK_THROWS_AS(rays(), int);
      setThrowing(false, 50, last);
      CHECK_THROWS_AS(probes(), int);
      CHECK(reported == 0);
    }
    // Then queries are answered one by one.
    setThrowing(true, 50, 51);
    CHECK(wrongRays(space, queries.rays, 0, owed_rays) == "");
    CHECK(calls > 51);
    setThrowing(true, 50, 51);
    CHECK(wrongOverlaps(space, queries.probes, 1, owed) == "");
    setThrowing(true, 0, kEnd);
    CHECK_THROWS_AS(rays(), std::bad_alloc);
    CHECK_THROWS_AS(probes(), std::bad_alloc);
    setThrowing(true, kEnd, kEnd);
    CHECK(wrongRays(space, queries.rays, 0, owed_rays) == "");
    CHECK(wrongOverlaps(space, queries.probes, 1, owed) == "");
  }
  dGeomSetPosition(world.geoms()[0], 1, 1, 1);  // not locked any more
}

TEST_CASE("Queries within a callback have the filter that is set then", "[filters]") {
  const Space space;
  for (int i = 0; i < 3; ++i) {
    const dGeomID ball = dCreateSphere(space, 1);
    dGeomSetPosition(ball, static_cast<dReal>(5 * i), 0, 0);
    dGeomSetCategoryBits(ball, 1u << i);
  }
  // All but the first ball; within the callback the last one alone.
  static const unsigned long all_but_first = 6, last = 4;
  const auto ofBits = [](void* bits, std::size_t, dGeomID geom) {
    return int((dGeomGetCategoryBits(geom) & *static_cast<unsigned long*>(bits)) != 0);
  };
  const auto setBits = [&](const unsigned long& bits) {
    dParallelSAPSpaceSetQueryFilter(space, ofBits, const_cast<unsigned long*>(&bits));
  };
  setBits(all_but_first);
  const Rays rays(2, rayOf({-5, 0, 0}, {1, 0, 0}, 50));
  std::vector<dReal> distances;
  const auto ask = [&] {
    for (const dParallelSAPRayHit& hit : nearestHits(space, rays, 0))
      distances.push_back(hit.distance);
  };
  std::function<void(std::size_t)> within = [&](std::size_t count) {
    CHECK(count == 2);
    setBits(last);
    ask();
    setBits(all_but_first);
  };
  dParallelSAPSpaceRayHits(space, rays.data(), 2, 0, &within,
                           [](void* data, std::size_t, const dParallelSAPRayHit*, std::size_t n) {
                             (*static_cast<decltype(within)*>(data))(n);
                           });
  ask();
  CHECK(distances == std::vector<dReal>{14, 14, 14, 14, 9, 9});
  const dGeomID probe = dCreateSphere(nullptr, 20);
  CHECK(collide2(space, probe).size() == 3);  // which no filter is for
  dGeomDestroy(probe);
}
