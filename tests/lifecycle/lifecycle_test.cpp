// Spaces and geoms may end in any order; who outlives a space is as good as new.
#include <chrono>

#include "support/tests.h"

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

std::vector<dGeomID> spheresInARow(dSpaceID space, std::size_t n) {
  std::vector<dGeomID> geoms;
  for (std::size_t i = 0; i < n; ++i) {
    geoms.push_back(dCreateSphere(space, dReal(0.6)));
    dGeomSetPosition(geoms.back(), real(i), 0, 0);
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

TEST_CASE("A space destroys its geoms, used or unused, nested or not, unless told not to",
          "[lifecycle]") {
  for (const std::size_t n : {0, 1, 30, 2000})
    for (const bool used : {false, true})
      for (const bool cleanup : {true, false})
        for (const bool ours : {true, false}) {
          const dSpaceID outer =
              ours ? dParallelSAPSpaceCreate(nullptr) : dHashSpaceCreate(nullptr);
          const dSpaceID space = dParallelSAPSpaceCreate(outer);
          const dSpaceID stock = dSimpleSpaceCreate(outer);
          REQUIRE(dGeomGetSpace(asGeom(space)) == outer);
          for (const dSpaceID inner : {space, stock}) {
            CHECK(dSpaceGetCleanup(inner) == 1);
            dSpaceSetCleanup(inner, cleanup);
          }
          createWitness(outer);
          std::vector<dGeomID> geoms = {createWitness(stock)};
          for (std::size_t i = 0; i < n; ++i) geoms.push_back(createWitness(space));
          if (used) CHECK(collide(outer).size() >= 1);
          if (used) CHECK(collide(space).size() == (n * n - n) / 2);
          destroyed = 0;
          dSpaceDestroy(outer);
          INFO(n << " geoms, used: " << used << ", cleanup: " << cleanup << ", ours: " << ours);
          CHECK(destroyed == (cleanup ? static_cast<int>(n) + 2 : 1));
          if (cleanup) continue;
          for (const dGeomID geom : geoms) {
            REQUIRE(dGeomGetSpace(geom) == nullptr);
            dGeomDestroy(geom);
          }
        }
}

TEST_CASE("Geoms wander between our space and every ODE space, and outlive both", "[lifecycle]") {
  // dQuadTreeSpace leaves its private fields set in geoms that outlive it.
  for (const Configuration& configuration : configurations()) {
    for (const StockSpace& stock : kStockSpaces) {
      for (const int variant : {0, 1, 2, 3}) {
        const int first = variant % 2;  // 1: ours, in which they are never brought up to date
        const bool outlive = variant / 2;
        INFO(configuration.name << ", " << stock.name << ", variant " << variant);
        const std::vector<dGeomID> geoms = spheresInARow(nullptr, 20);
        for (int round = first; round < (outlive ? first + 2 : 6); ++round) {
          const bool ours = round % 2;
          const dSpaceID space = ours ? dParallelSAPSpaceCreate(nullptr) : stock.create(nullptr);
          if (ours) configure(space, configuration);
          dSpaceSetCleanup(space, 0);
          for (const dGeomID geom : geoms) dSpaceAdd(space, geom);
          if (round != 1 || first == 0) {
            const Pairs pairs = collide(space);
            REQUIRE(difference(ours ? pairs : asSet(pairs), neighbours(20)) == "");
          }
          for (std::size_t i = 0; i < geoms.size() && !outlive; ++i) dSpaceRemove(space, geoms[i]);
          if (!outlive) REQUIRE(collide(space).empty());
          dSpaceDestroy(space);
        }
        for (const dGeomID geom : geoms) dGeomDestroy(geom);
      }
    }
  }
}

TEST_CASE("dSpaceGetGeom is as fast at the back, and after a geom has left", "[lifecycle]") {
  // From the back, where dHashSpace goes through its list in each call, and in order with a gap.
  using Clock = std::chrono::steady_clock;
  const auto timeOf = [](dSpaceID of, bool backward) {
    for (int i = 0; i < 8000; ++i) dCreateSphere(of, 1);
    if (!backward) dGeomDestroy(dSpaceGetGeom(of, 0));
    const auto begin = Clock::now();
    if (backward)
      for (int n = dSpaceGetNumGeoms(of); n > 0; --n) dGeomDestroy(dSpaceGetGeom(of, n - 1));
    else
      for (int i = 0; i < dSpaceGetNumGeoms(of); ++i) REQUIRE(dSpaceGetGeom(of, i));
    return Clock::now() - begin;
  };
  const dSpaceID stock = dHashSpaceCreate(nullptr);
  const auto of_stock = timeOf(stock, true);
  for (const bool backward : {false, true}) CHECK(timeOf(Space(), backward) * 10 < of_stock);
  dSpaceDestroy(stock);
}
