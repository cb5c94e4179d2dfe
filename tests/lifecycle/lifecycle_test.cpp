// Spaces, geoms, bodies and worlds may end in any order; who outlives a space is as good as new.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

int destroyed = 0;

// A geom that tells when it goes.
dGeomID createWitness(dSpaceID space) {
  static const int geom_class = [] {
    dGeomClass description = {};
    description.collider = [](int) -> dColliderFn* { return nullptr; };
    description.aabb = [](dGeomID, dReal aabb[6]) {
      for (int i = 0; i < 6; ++i) aabb[i] = i % 2 ? dReal(1) : dReal(-1);
    };
    description.dtor = [](dGeomID) { ++destroyed; };
    return dCreateGeomClass(&description);
  }();
  const dGeomID geom = dCreateGeom(geom_class);
  dSpaceAdd(space, geom);
  return geom;
}

struct StockSpace {
  const char* name;
  std::function<dSpaceID(dSpaceID)> create;
};

const std::vector<StockSpace>& stockSpaces() {
  static const std::vector<StockSpace> all = {
      {"dSimpleSpace", [](dSpaceID parent) { return dSimpleSpaceCreate(parent); }},
      {"dHashSpace", [](dSpaceID parent) { return dHashSpaceCreate(parent); }},
      {"dSweepAndPruneSpace",
       [](dSpaceID parent) { return dSweepAndPruneSpaceCreate(parent, dSAP_AXES_XYZ); }},
      {"dQuadTreeSpace",
       [](dSpaceID parent) {
         const dVector3 centre = {0, 0, 0, 0}, extents = {20, 20, 20, 0};
         return dQuadTreeSpaceCreate(parent, centre, extents, 3);
       }},
  };
  return all;
}

std::vector<dGeomID> spheresInARow(dSpaceID space, std::size_t n) {
  std::vector<dGeomID> geoms;
  for (std::size_t i = 0; i < n; ++i) {
    geoms.push_back(dCreateSphere(space, dReal(0.6)));
    dGeomSetPosition(geoms.back(), static_cast<dReal>(i), 0, 0);
    setNumber(geoms.back(), i);
  }
  return geoms;
}

Pairs neighbours(std::size_t n) {
  Pairs pairs;
  for (std::size_t i = 0; i + 1 < n; ++i) pairs.emplace_back(i, i + 1);
  return pairs;
}

}  // namespace

TEST_CASE("A space destroys its geoms, used or unused, unless told not to", "[lifecycle]") {
  for (const std::size_t n : {0, 1, 30, 2000}) {
    for (const bool used : {false, true}) {
      for (const bool cleanup : {true, false}) {
        const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
        CHECK(dSpaceGetCleanup(space) == 1);
        if (!cleanup) dSpaceSetCleanup(space, 0);
        std::vector<dGeomID> geoms;
        for (std::size_t i = 0; i < n; ++i) geoms.push_back(createWitness(space));
        if (used) CHECK(collide(space).size() == (n * n - n) / 2);
        destroyed = 0;
        dSpaceDestroy(space);
        INFO(n << " geoms, used: " << used << ", cleanup: " << cleanup);
        CHECK(destroyed == (cleanup ? static_cast<int>(n) : 0));
        if (cleanup) continue;
        for (const dGeomID geom : geoms) {
          REQUIRE(dGeomGetSpace(geom) == nullptr);
          dGeomDestroy(geom);
        }
        CHECK(destroyed == static_cast<int>(n));
      }
    }
  }
}

TEST_CASE("Nested spaces end with their parents, each by its own cleanup mode", "[lifecycle]") {
  for (const bool outer_ours : {true, false}) {
    for (const bool inner_ours : {true, false}) {
      for (const bool inner_cleanup : {true, false}) {
        const dSpaceID outer =
            outer_ours ? dParallelSAPSpaceCreate(nullptr) : dHashSpaceCreate(nullptr);
        const dSpaceID inner =
            inner_ours ? dParallelSAPSpaceCreate(outer) : dSimpleSpaceCreate(outer);
        REQUIRE(dGeomGetSpace(asGeom(inner)) == outer);
        REQUIRE(dSpaceQuery(outer, asGeom(inner)));
        createWitness(outer);
        const dGeomID a = createWitness(inner), b = createWitness(inner);
        dSpaceSetCleanup(inner, inner_cleanup);
        CHECK(collide(outer).size() == 1);
        destroyed = 0;
        dSpaceDestroy(outer);
        INFO("outer ours: " << outer_ours << ", inner ours: " << inner_ours);
        CHECK(destroyed == (inner_cleanup ? 3 : 1));
        if (inner_cleanup) continue;
        CHECK(dGeomGetSpace(a) == nullptr);
        dGeomDestroy(a);
        dGeomDestroy(b);
      }
    }
  }
}

TEST_CASE("A nested space that goes first leaves its parent's pairs right", "[lifecycle]") {
  for (const Configuration& configuration : configurations()) {
    const Space outer(configuration);
    setNumber(dCreateSphere(outer, 1), 0);
    const dSpaceID inner = dParallelSAPSpaceCreate(outer);
    setNumber(asGeom(inner), 1);
    dCreateSphere(inner, 1);
    setNumber(dCreateSphere(outer, 1), 2);
    INFO(configuration.name);
    CHECK(difference(collide(outer), {{0, 1}, {0, 2}, {1, 2}}) == "");
    dSpaceDestroy(inner);
    CHECK(dSpaceGetNumGeoms(outer) == 2);
    CHECK(difference(collide(outer), {{0, 2}}) == "");
  }
}

TEST_CASE("Geoms end before their space in any order", "[lifecycle]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {10, 300}) {
      for (const int order : {0, 1, 2}) {
        const Space space(configuration);
        std::vector<dGeomID> geoms = spheresInARow(space, n);
        REQUIRE(difference(collide(space), neighbours(n)) == "");
        if (order == 1) std::reverse(geoms.begin(), geoms.end());
        if (order == 2) {
          Random random(1);
          for (std::size_t i = n; i > 1; --i) std::swap(geoms[i - 1], geoms[random.below(i)]);
        }
        INFO(configuration.name << ", " << n << " geoms, order " << order);
        while (!geoms.empty()) {
          dGeomDestroy(geoms.back());
          geoms.pop_back();
          REQUIRE(dSpaceGetNumGeoms(space) == static_cast<int>(geoms.size()));
          std::vector<dGeomID> left = geoms;
          std::sort(left.begin(), left.end(),
                    [](dGeomID a, dGeomID b) { return number(a) < number(b); });
          REQUIRE(difference(collide(space), expectedPairs(left)) == "");
        }
      }
    }
  }
}

TEST_CASE("Bodies and worlds may end before the geoms and the space", "[lifecycle]") {
  for (const Configuration& configuration : configurations()) {
    for (const bool whole_world : {true, false}) {
      const Space space(configuration);
      const dWorldID world = dWorldCreate();
      const std::vector<dGeomID> geoms = spheresInARow(space, 40);
      std::vector<dBodyID> bodies;
      for (const dGeomID geom : geoms) {
        bodies.push_back(dBodyCreate(world));
        dGeomSetBody(geom, bodies.back());
        dBodySetPosition(bodies.back(), static_cast<dReal>(number(geom)), 0, 0);
      }
      REQUIRE(difference(collide(space), neighbours(40)) == "");
      dBodySetPosition(bodies[3], 100, 0, 0);
      if (!whole_world) {
        for (const dBodyID body : bodies) dBodyDestroy(body);
      }
      dWorldDestroy(world);
      INFO(configuration.name << ", whole world: " << whole_world);
      CHECK(difference(collide(space), expectedPairs(geoms)) == "");
      CHECK(dGeomGetBody(geoms[0]) == nullptr);
      dGeomSetPosition(geoms[3], 3, 0, 0);
      CHECK(difference(collide(space), neighbours(40)) == "");
    }
  }
}

TEST_CASE("A space may end before the bodies of its geoms", "[lifecycle]") {
  const dWorldID world = dWorldCreate();
  const dBodyID body = dBodyCreate(world);
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  dGeomSetBody(dCreateSphere(space, 1), body);
  dGeomSetBody(dCreateBox(space, 1, 1, 1), body);
  CHECK(collide(space).empty());
  dSpaceDestroy(space);
  CHECK(dBodyGetFirstGeom(body) == nullptr);
  dBodySetPosition(body, 1, 2, 3);
  dWorldDestroy(world);
}

TEST_CASE("Geoms that outlive our space are at home in every ODE space", "[lifecycle]") {
  for (const StockSpace& stock : stockSpaces()) {
    for (const bool clean : {false, true}) {
      const dSpaceID ours = dParallelSAPSpaceCreate(nullptr);
      dSpaceSetCleanup(ours, 0);
      const std::vector<dGeomID> geoms = spheresInARow(ours, 20);
      if (clean) REQUIRE(difference(collide(ours), neighbours(20)) == "");
      dSpaceDestroy(ours);
      const dSpaceID theirs = stock.create(nullptr);
      for (const dGeomID geom : geoms) dSpaceAdd(theirs, geom);
      INFO(stock.name << ", clean: " << clean);
      CHECK(difference(asSet(collide(theirs)), neighbours(20)) == "");
      for (const dGeomID geom : geoms) dGeomDestroy(geom);
      dSpaceDestroy(theirs);
    }
  }
}

TEST_CASE("Geoms wander between our space and every ODE space", "[lifecycle]") {
  for (const Configuration& configuration : configurations()) {
    for (const StockSpace& stock : stockSpaces()) {
      const Space ours(configuration);
      const dSpaceID theirs = stock.create(nullptr);
      const std::vector<dGeomID> geoms = spheresInARow(ours, 20);
      INFO(configuration.name << ", " << stock.name);
      for (int round = 0; round < 3; ++round) {
        REQUIRE(difference(collide(ours), neighbours(20)) == "");
        for (const dGeomID geom : geoms) {
          dSpaceRemove(ours, geom);
          dSpaceAdd(theirs, geom);
        }
        REQUIRE(collide(ours).empty());
        REQUIRE(difference(asSet(collide(theirs)), neighbours(20)) == "");
        for (const dGeomID geom : geoms) {
          dSpaceRemove(theirs, geom);
          dSpaceAdd(ours, geom);
        }
      }
      dSpaceDestroy(theirs);
    }
  }
}

TEST_CASE("Geoms that outlive any ODE space are at home in ours", "[lifecycle]") {
  // dQuadTreeSpace leaves its private fields set in geoms that outlive it.
  for (const Configuration& configuration : configurations()) {
    for (const StockSpace& stock : stockSpaces()) {
      const dSpaceID theirs = stock.create(nullptr);
      dSpaceSetCleanup(theirs, 0);
      const std::vector<dGeomID> geoms = spheresInARow(theirs, 20);
      REQUIRE(difference(asSet(collide(theirs)), neighbours(20)) == "");
      dSpaceDestroy(theirs);
      const Space ours(configuration);
      for (const dGeomID geom : geoms) dSpaceAdd(ours, geom);
      INFO(configuration.name << ", " << stock.name);
      CHECK(difference(collide(ours), neighbours(20)) == "");
      dSpaceRemove(ours, geoms[5]);
      dSpaceAdd(ours, geoms[5]);
      CHECK(collide(ours).size() == 19);
    }
  }
}

TEST_CASE("Our space lives in every ODE space and every ODE space in ours", "[lifecycle]") {
  for (const StockSpace& stock : stockSpaces()) {
    INFO(stock.name);
    {
      const dSpaceID outer = stock.create(nullptr);
      const dSpaceID inner = dParallelSAPSpaceCreate(outer);
      spheresInARow(inner, 20);
      const dGeomID probe = dCreateSphere(outer, 1);
      CHECK(dSpaceGetNumGeoms(outer) == 2);
      dGeomSetPosition(probe, 10, 0, 0);
      CHECK(collide(outer).size() == 1);
      CHECK(difference(collide(inner), neighbours(20)) == "");
      dSpaceDestroy(outer);
    }
    {
      const Space outer;
      const dSpaceID inner = stock.create(outer);
      const dGeomID probe = dCreateSphere(outer, 1);
      setNumber(probe, 99);
      spheresInARow(inner, 20);
      CHECK(difference(asSet(collide(inner)), neighbours(20)) == "");
      CHECK(collide(outer).size() == 1);
      CHECK(collide2(inner, probe).size() == 2);
      dSpaceDestroy(inner);
      CHECK(collide(outer).empty());
    }
  }
}

TEST_CASE("Many spaces come and go", "[lifecycle]") {
  for (int round = 0; round < 200; ++round) {
    const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
    const std::size_t n = static_cast<std::size_t>(round % 50);
    spheresInARow(space, n);
    REQUIRE(difference(collide(space), neighbours(n)) == "");
    dSpaceDestroy(space);
  }
}
