// Pairs that are certainly apart are not collided: what becomes of contacts and callbacks.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>
#include <cstdint>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/contact_scene.h"
#include "support/knobs.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

const char* const kVariable = "ODE_PARALLEL_SAP_TEST_APART";
const int kThreads[] = {1, 2, 3, 7};

void fill(ContactScene& scene, std::size_t n, std::uint64_t seed) {
  for (std::uint64_t i = 0; i < 3; ++i) scene.add(Kind::Plane, 0, seed + i);
  scene.fill({Kind::Sphere, Kind::Box, Kind::Capsule, Kind::OffsetBox, Kind::Cylinder}, n, seed);
}

// So many pairs of boxes that touch and so many that do not, but in their AABBs.
void addPairs(dSpaceID space, int touching, int apart) {
  dMatrix3 matrix;
  dRFromEulerAngles(matrix, dReal(0.7), dReal(0.5), dReal(0.3));
  for (int i = 0; i < touching + apart; ++i) {
    const dReal off = i < touching ? dReal(0.5) : dReal(2.1);
    for (const dReal place : {dReal(0), off}) {
      const dGeomID box = dCreateBox(space, 2, 2, 2);
      dGeomSetRotation(box, matrix);
      dGeomSetPosition(box, static_cast<dReal>(10 * i) + place, place, place);
    }
  }
}

}  // namespace

TEST_CASE("Contacts are the same whether or not what is apart is left out", "[apart]") {
  const std::uint64_t seed = seedOr(3201);
  for (const std::size_t n : {40, 1200})
    for (const char* const look : {"0", "1"}) {
      const Variable variable(kVariable, look);
      const Space space;
      ContactScene scene(space);
      fill(scene, n, seed);
      for (const int threads : kThreads) {
        INFO(n << " geoms, " << threads << " threads, " << kVariable << '=' << look
               << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        scene.move(seed + static_cast<std::uint64_t>(threads));
        dParallelSAPSpaceSetNumThreads(space, threads);
        const Contacts expected = serialContacts(space, {8});
        REQUIRE(difference(parallelContacts(space, 8), expected) == "");
        const dParallelSAPStats stats = statsOf(space);
        CHECK((stats.apart > 0) == (*look == '1'));
        CHECK(stats.apart < stats.pairs);
      }
    }
}

TEST_CASE("Pairs that are left out are asked for their flags, not to be reduced", "[apart]") {
  static std::atomic<unsigned long long> asked, reduced;
  const auto flags = [](void*, dGeomID, dGeomID) {
    ++asked;
    return 4;
  };
  const auto reduce = [](void*, dGeomID, dGeomID, dContactGeom*, int count) {
    ++reduced;
    return count;
  };
  const Variable variable(kVariable, "1");
  const Space space;
  addPairs(space, 70, 90);
  for (const int threads : kThreads) {
    dParallelSAPSpaceSetNumThreads(space, threads);
    asked = reduced = 0;
    parallelContacts(space, 0, {nullptr, flags, reduce, nullptr});
    CHECK(statsOf(space).apart == 90);
    CHECK(asked == 160);
    CHECK(reduced == 70);
  }
}

TEST_CASE("Some flags keep a pair from being left out", "[apart]") {
  const Variable variable(kVariable, "1");
  const Space space;
  addPairs(space, 80, 80);
  for (const int flag :
       {0, static_cast<int>(CONTACTS_UNIMPORTANT), static_cast<int>(dParallelSAPOnCallingThread)}) {
    parallelContacts(space, 4 | flag);
    CHECK(statsOf(space).apart == (flag ? 0 : 80));
  }
  parallelContacts(space, 4,
                   {nullptr, [](void*, dGeomID, dGeomID) { return 0; }, nullptr, nullptr});
  CHECK(statsOf(space).apart == 0);  // nor were they collided
}

// Whatever ODE's collider of boxes finds when it looks along one axis only.
TEST_CASE("Unimportant contacts of boxes are those of the serial loop", "[apart]") {
  const std::uint64_t seed = seedOr(3202);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  const Variable variable(kVariable, "1");
  const Space space;
  ContactScene scene(space);
  scene.fill({Kind::Box, Kind::OffsetBox}, 1500, seed);
  const int flags = 8 | static_cast<int>(CONTACTS_UNIMPORTANT);
  CHECK(difference(parallelContacts(space, flags), serialContacts(space, {flags})) == "");
}
