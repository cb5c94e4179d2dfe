// Rays alone: the hits of a loop over dCollide, however near to what rounding could hide.
#include <chrono>

#include "support/contact_scene.h"
#include "support/ray_oracle.h"
#include "support/tests.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

std::size_t hitsOf(const RayHits& hits) {
  return RayBatch::meeting({hits, {}});
}

// A collider that finds one contact, so far away; 0: nobody knows how far.
template <int distance>
int hitAt(dGeomID o1, dGeomID o2, int, dContactGeom* contact, int) {
  *contact = {};
  contact->depth = distance ? dReal(distance) : kNaN;
  contact->g1 = o1;
  contact->g2 = o2;
  return 1;
}

}  // namespace

TEST_CASE("Over heightfields the nearest of all hits counts, and none beside the ray", "[rays]") {
  const std::uint64_t seed = seedOr(413);
  constexpr int kSamples = 161;
  static double heights[kSamples * 2];  // ridges: a ray along them has more hits than most geoms
  for (int i = 0; i < 2 * kSamples; ++i) heights[i] = i % kSamples % 2 ? 1 : 0.2 * (i % 7);
  const dHeightfieldDataID data = dGeomHeightfieldDataCreate();
  enum { fixed, placed, carried };
  for (const bool endless : {false, true})
    for (const int way : {fixed, placed, carried}) {
      dGeomHeightfieldDataBuildDouble(data, heights, 0, 7, 1, kSamples, 2, 1, 0, 1, endless);
      const Space space;
      World world(space);
      dGeomID field =
          dCreateHeightfield(way == carried ? nullptr : dSpaceID(space), data, way != fixed);
      if (way == carried) field = createTransform(space, field);
      world.take(field);
      if (way != fixed) dGeomSetPosition(field, dReal(0.3), dReal(0.1), dReal(-0.2));
      // In the ground, where ODE finds a contact of rays that meet nothing.
      const dGeomID stone = world.take(dCreateSphere(space, dReal(0.1)));
      dGeomSetPosition(stone, 1, -1, 0);
      Random random(seed);
      Rays rays = {rayOf({-3, -1, 0}, {1, 0, 0}, 6), rayOf({1, -3, 0}, {0, 1, 0}, 2.9),
                   rayOf({-3, -2, 0}, {1, 0, 0}, 6), rayOf({1, -0.5, 0}, {0.1, -1, 0}, 0.3),
                   rayOf({-3.5, 0.7, 0.1}, {1, 0, 0}, 7)};
      for (int i = 0; i < 100; ++i)
        rays.push_back(rayOf({random.between(-3, 3), random.between(-0.5, 1.5), 0.1},
                             {random.gauss(), 0.1 * random.gauss(), 0.02 * random.gauss()}, 6));
      dContactGeom contact;
      const dGeomID below = dCreateRay(nullptr, 6);
      dGeomRaySet(below, -3, -2, 0, 1, 0, 0);
      CHECK(dCollide(below, field, 1, &contact, sizeof contact) == 1);
      dGeomDestroy(below);
      for (const int flags : {0, 3, 200, 200 | dParallelSAPRayClosestHit})
        for (const int threads : {1, 7}) {
          INFO("endless " << endless << ", way " << way << ", flags " << flags << ", " << threads
                          << " threads, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
          dParallelSAPSpaceSetNumThreads(space, threads);
          REQUIRE(wrongRays(space, world.geoms(), rays, flags) == "");
        }
      const RayHits nearest = nearestHits(space, rays, 0);
      for (int i = 0; i < 4; ++i) CHECK(nearest[i].geom == (i < 2 ? stone : nullptr));
      CHECK(allHits(space, rays, 0xffff)[4].size() > 64);  // more than are asked for at first
    }
  dGeomHeightfieldDataDestroy(data);
}

namespace {

// Shapes of like sizes around a place in a space, turned anyhow, and the chance that made them.
struct RoundScene {
  Space space;
  World world{space};
  Random random;

  RoundScene(std::uint64_t seed, std::size_t n, double size, const double (&at)[3], double spread)
      : random(seed) {
    for (std::size_t i = 0; i < n; ++i) {
      const double s = size * random.between(0.5, 2);
      const std::size_t kind = random.below(4);
      const dGeomID geom =
          world.take(kind == 0   ? dCreateSphere(space, real(s))
                     : kind == 1 ? dCreateBox(space, real(s), real(2 * s), real(s / 3))
                     : kind == 2 ? dCreateCapsule(space, real(s / 3), real(s))
                                 : dCreateCylinder(space, real(s / 3), real(s)));
      dMatrix3 turned;
      const auto angle = [&] { return real(random.between(-3, 3)); };
      dRFromEulerAngles(turned, angle(), angle(), angle());
      // Also of so few digits as files have.
      if (random.chance(0.3))
        for (dReal& number : turned) number = static_cast<float>(number);
      // And what is no rotation at all.
      if (random.chance(0.05))
        for (dReal& number : turned) number *= real(random.between(0.5, 2));
      dGeomSetRotation(geom, turned);
      const auto place = [&](int axis) { return real(at[axis] + spread * random.gauss()); };
      dGeomSetPosition(geom, place(0), place(1), place(2));
    }
  }
};

// At the rim of a sphere or the round side of what is about as thick, from far away: where rounding
// decides.
dParallelSAPRay grazing(dGeomID geom, double size, Random& random) {
  const dReal* const at = dGeomGetPosition(geom);
  double along[3], aside[3], from[3], dot = 0, square = 0, length = 0;
  for (int axis = 0; axis < 3; ++axis) {
    along[axis] = random.gauss();
    aside[axis] = random.gauss();
    square += along[axis] * along[axis];
    dot += along[axis] * aside[axis];
  }
  for (int axis = 0; axis < 3; ++axis) {
    aside[axis] -= dot / square * along[axis];
    length += aside[axis] * aside[axis];
  }
  const double far = size * std::pow(10, random.between(0, 8));
  const double rim = dGeomGetClass(geom) == dSphereClass ? dGeomSphereGetRadius(geom) : size / 3;
  const double off =
      rim * (1 + std::pow(10, random.between(-9, -0.5)) * (random.chance(0.3) ? -1 : 1));
  for (int axis = 0; axis < 3; ++axis)
    from[axis] =
        at[axis] + aside[axis] / std::sqrt(length) * off - along[axis] / std::sqrt(square) * far;
  return rayOf(from, along, far * random.between(0.9, 2));
}

}  // namespace

TEST_CASE("A mesh whose callback declines the nearest triangle is hit at the next one", "[rays]") {
  const std::uint64_t seed = seedOr(417);
  const Space space;
  ContactScene scene(space);
  scene.fill({Kind::WatchedTorus}, 20, seed);
  std::vector<dGeomID> geoms;
  for (int i = 0; i < 20; ++i) geoms.push_back(dSpaceGetGeom(space, i));
  Random random(seed);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  REQUIRE(wrongRays(space, geoms, raysAt(geoms, 500, random), 0) == "");
}

TEST_CASE("Rays that graze their geoms from far away hit what rounding lets dCollide find",
          "[rays]") {
  const std::uint64_t seed = seedOr(421);
  std::size_t beyond = 0;
  for (const double size : {1e-3, 1.0, 50.0})
    for (const double away : {0.0, 1e3, 1e7}) {
      RoundScene scene(seed, 200, size, {away, -away / 3, away}, 4 * size);
      auto& [space, world, random] = scene;
      Rays rays;
      for (int i = 0; i < scaled(3000); ++i)
        rays.push_back(grazing(world.geoms()[random.below(200)], size, random));
      INFO("size " << size << ", " << away << " away, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      REQUIRE(wrongRays(space, world.geoms(), rays, 0) == "");
      for (const auto& hits : owedRays(world.geoms(), rays, 0).all)
        for (const dParallelSAPRayHit& hit : hits) {
          dReal bounds[6];
          dGeomGetAABB(hit.geom, bounds);
          bool inside = true;
          for (int axis = 0; axis < 3; ++axis)
            inside = inside && hit.pos[axis] >= bounds[2 * axis] &&
                     hit.pos[axis] <= bounds[2 * axis + 1];
          beyond += !inside;
        }
    }
  // Otherwise this would have tested nothing that exact numbers would not show.
  CHECK(beyond > 20);
}

TEST_CASE("A kept box whose matrix is a rotation no more is hit where its collider hits it",
          "[rays]") {
  const Space space;
  World world(space, denseCube(300, 1));
  const dGeomID box = world.geoms()[7];
  const dReal* const at = dGeomGetPosition(box);
  // Past its AABB by more than errors of rounding.
  const Rays rays(20, rayOf({at[0] - 3, at[1] - 2.4, at[2]}, {1, 1, 0}, 8));
  REQUIRE(wrongRays(space, world.geoms(), rays, 0) == "");
  const dMatrix3 quarter = {0.25, 0, 0, 0, 0, 0.25, 0, 0, 0, 0, 0.25, 0};
  dGeomSetRotation(box, quarter);
  REQUIRE(wrongRays(space, world.geoms(), rays, 0) == "");
}

TEST_CASE("Rays in scenes of any size and place hit what a loop over dCollide hits", "[rays]") {
  const std::uint64_t seed = seedOr(431);
  for (const double size : {1e-310, 1e-160, 1e-40, 1e-6, 1e6, 1e14, 1e20, 1e40, 1e100})
    for (const double away : {0.0, 1e6, 1e16}) {
      if (real(size) == 0 || real(size * 1e6) == kInfinity) continue;
      RoundScene scene(seed, 150, size, {size * away, 0, -size * away}, 5 * size);
      auto& [space, world, random] = scene;
      const Rays rays = raysAt(world.geoms(), 200, random);
      INFO("size " << size << ", " << away << " away, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      REQUIRE(wrongRays(space, world.geoms(), rays, 0) == "");
    }
}

TEST_CASE("Rays through a large space within the space leave it its tree", "[rays]") {
  const Space space;
  const dSpaceID large = dParallelSAPSpaceCreate(space);
  for (int i = 0; i < 400; ++i) dGeomSetPosition(dCreateSphere(large, 1), real(i), 0, 0);
  const Rays rays(20, rayOf({30, 0, 5}, {0, 0, -1}, 10));
  for (int frame = 0; frame < 4; ++frame) {
    REQUIRE(hitsOf(nearestHits(space, rays, 0)) == rays.size());
    dGeomSetPosition(dSpaceGetGeom(large, 7), 7, real(0.1 * frame), 0);
    collide(large);
    CHECK((statsOf(large).kept > 0) == (frame > 0));
  }
}

TEST_CASE(
    "Of equal hits in a sub-space that of its first geom counts, of those in sorting ones of "
    "the last one added",
    "[rays]") {
  for (int kind = 0; kind < 7; ++kind) {
    const std::size_t n = kind < 5 ? 3 : 300;
    const Space space;
    const dSpaceID inner = kind == 4 || kind == 6 ? dParallelSAPSpaceCreate(space)
                                                  : kStockSpaces[kind % 4].create(space);
    std::vector<dGeomID> geoms;
    while (geoms.size() < n) geoms.push_back(dCreateSphere(inner, 1));
    const Rays rays(30, rayOf({-5, 0, 0}, {1, 0, 0}, 10));
    for (int frame = 0; frame < 3; ++frame) {
      CAPTURE(kind, frame);
      const bool sorting = kind == 2 || kind == 3;
      const dGeomID expected = sorting ? geoms[2] : dSpaceGetGeom(inner, 0);
      CHECK(nearestHits(space, rays, 0)[0].geom == expected);
      dGeomSetPosition(geoms[static_cast<std::size_t>(frame)], 0, 0, 0);
    }
  }
}

TEST_CASE("A ray of infinite length hits what a long one hits", "[rays]") {
  for (const std::size_t n : {1, 1000}) {
    const Space space;
    World world(space, denseCube(n, 5));
    Rays endless, long_ones;
    Random random(seedOr(461));
    for (int i = 0; i < 60; ++i) {
      dReal bounds[6];
      dGeomGetAABB(world.geoms()[random.below(n)], bounds);
      double from[3] = {bounds[0] + 0.3, bounds[2] + 0.3, bounds[4] + 0.3}, along[3] = {0, 0, 0};
      along[i % 3] = i % 2 ? 1 : -1;
      from[i % 3] = i % 2 ? -50 : 80;
      endless.push_back(rayOf(from, along, kInfinity));
      long_ones.push_back(rayOf(from, along, 1000));
    }
    for (int times = 0; times < 20; ++times) {  // without trees and with them
      const RayHits hits = nearestHits(space, endless, 0);
      const RayHits expected = nearestHits(space, long_ones, 0);
      CAPTURE(n, times);
      REQUIRE(hitsOf(hits) == 60);
      REQUIRE(std::equal(hits.begin(), hits.end(), expected.begin(), sameBits));
    }
    CHECK(dParallelSAPSpaceRays(space, nullptr, 0, 0, nullptr) == 0);
  }
}

TEST_CASE("A hit whose distance is NaN is farther than all others", "[rays]") {
  const Space space;
  const int user_class = dGeomGetClass(createUserBox(space, {1, 2, -1, 1, -1, 1}));
  dSetColliderOverride(user_class, dRayClass, hitAt<0>);
  const dGeomID ball = dCreateSphere(space, 1);
  dGeomSetPosition(ball, 5, 0, 0);
  const Rays rays = {rayOf({0, 0, 0}, {1, 0, 0}, 9)};
  CHECK(nearestHits(space, rays, 0)[0].geom == ball);
  CHECK(allHits(space, rays, 0)[0][0].geom == ball);
  dSetColliderOverride(user_class, dRayClass, nullptr);
}

TEST_CASE("A user's class that rejects rays is hit by none, by any number of threads", "[rays]") {
  const Space space;
  const auto reject = [](dGeomID, dGeomID, dReal[6]) { return 0; };
  const int user_class = dGeomGetClass(createUserBox(space, {1, 2, -1, 1, -1, 1}, false, reject));
  dSetColliderOverride(user_class, dRayClass, hitAt<0>);
  for (const int threads : {1, 3}) {
    dParallelSAPSpaceSetNumThreads(space, threads);
    CHECK(hitsOf(nearestHits(space, Rays(80, rayOf({0, 0, 0}, {1, 0, 0}, 9)), 0)) == 0);
  }
  dSetColliderOverride(user_class, dRayClass, nullptr);
}

TEST_CASE("Of hits as far away in a sub-space the first geom's counts, whoever collides",
          "[rays]") {
  const Space space;
  const dSpaceID within = dSimpleSpaceCreate(space);
  const int user_class = dGeomGetClass(createUserBox(within, {1, 9, -1, 1, -1, 1}));
  const dGeomID ball = dCreateSphere(within, 1);  // in front, as in any stock space
  dGeomSetPosition(ball, 5, 0, 0);
  dSetColliderOverride(user_class, dRayClass, hitAt<4>);
  for (const int threads : {1, 3}) {
    dParallelSAPSpaceSetNumThreads(space, threads);
    for (const dParallelSAPRayHit& hit :
         nearestHits(space, Rays(80, rayOf({0, 0, 0}, {1, 0, 0}, 9)), 0))
      REQUIRE(hit.geom == ball);
  }
  dSetColliderOverride(user_class, dRayClass, nullptr);
}

TEST_CASE("Few colliders are asked for the nearest hit of a ray among many geoms", "[rays]") {
  // A row of spheres along the ray: those behind the first are not asked, so that their hits would
  // be found at no cost. Told from the time, of which a small part is left.
  const Space space;
  World world(space);
  for (int i = 0; i < 20000; ++i)
    dGeomSetPosition(world.take(dCreateSphere(space, 1)), real(3 * i), 0, 0);
  dParallelSAPSpaceSetNumThreads(space, 1);
  const Rays rays(2000, rayOf({-5, 0, 0}, {1, 0, 0}, 1e6));
  REQUIRE(hitsOf(nearestHits(space, rays, 0)) == rays.size());
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  nearestHits(space, rays, 0);
  const Clock::time_point middle = Clock::now();
  allHits(space, Rays(20, rays[0]), 0);
  CHECK(middle - begin < Clock::now() - middle);  // a hundred times as many rays
}
