// Meshes whose triangles change without a word to any space: dGeomTriMeshSetData tells none.
#include <ode_parallel_sap/parallel_sap_space.h>

#include "support/bounds.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/contact_scene.h"
#include "support/mesh.h"
#include "support/ray_oracle.h"
#include "support/recorder.h"

using namespace sap_test;

namespace {

constexpr dReal kHere = 100;

// One triangle at each place, from x to x + 1; the second one is here.
struct Triangles {
  const Mesh away{{170, 0, 0, 171, 0, 0, 170, 1, 1}, {0, 1, 2}},
      here{{100, 0, 0, 101, 0, 0, 100, 1, 1}, {0, 1, 2}};

  dTriMeshDataID at(bool place) const { return (place ? here : away).data(); }
};

// How much a call tells, but for a sphere that the probe and the ray meet.
std::size_t toldBy(std::size_t call, dSpaceID space, dGeomID probe) {
  dParallelSAPProbe one = {probe, nullptr, 0};
  switch (call) {
    case 0:
      return collide(space).size();
    case 1:
      dParallelSAPSpaceCollidePairs(space, nullptr, 0, nullptr);
      return statsOf(space).pairs;
    case 2:
      return parallelContacts(space, 1).size();
    case 3:
      return collide2(asGeom(space), probe).size() - 1;
    case 4:
      return collide2(probe, asGeom(space)).size() - 1;
    case 5:
      return dParallelSAPSpaceOverlaps(space, &one, 1, sizeof one, 1, nullptr, nullptr) - 1;
    default:
      return allHits(space, {rayOf({kHere + 0.3, 0.25, 5}, {0, 0, -1}, 10)}, 1)[0].size() - 1;
  }
}

constexpr std::size_t kCalls = 7;

}  // namespace

TEST_CASE(
    "A mesh that moved and then got other triangles is found, whoever asked for AABBs between",
    "[silent]") {
  const Triangles triangles;
  for (const auto create : {dSimpleSpaceCreate, dHashSpaceCreate, dParallelSAPSpaceCreate}) {
    const Space space;
    const dSpaceID within = create(space);
    const dGeomID mesh = triangles.away.create(within);
    const dGeomID host = dCreateSphere(space, 1), probe = dCreateSphere(nullptr, 1);
    for (const dGeomID geom : {host, probe}) dGeomSetPosition(geom, kHere, 0, 0);
    for (std::size_t call = 0; call < kCalls; ++call) {
      CAPTURE(call);
      const std::size_t away = toldBy(call, space, probe);
      dGeomSetPosition(mesh, 0, 0, 0);
      (void)boundsOf(asGeom(within));
      dGeomTriMeshSetData(mesh, triangles.at(true));
      CHECK(toldBy(call, space, probe) == away + 1);
      dGeomTriMeshSetData(mesh, triangles.at(false));
    }
    dGeomDestroy(probe);
  }
}

TEST_CASE("A space that is the geom of a query brings its meshes up to date first", "[silent]") {
  const Triangles triangles;
  const Space space, other;
  dSpaceSetSublevel(space, 1);  // so that its geoms meet the other space as one geom
  dGeomSetPosition(dCreateBox(space, 2, 2, 2), kHere, 0, 0);
  const dGeomID mesh = triangles.away.create(other);
  CHECK(collide2(space, other.geom()).empty());
  dGeomTriMeshSetData(mesh, triangles.at(true));
  CHECK(collide2(space, other.geom()).size() == 1);
}

namespace {

// Down to pairs of geoms.
void recordWithin(void* pairs, dGeomID a, dGeomID b) {
  if (dGeomIsSpace(a) || dGeomIsSpace(b))
    dSpaceCollide2(a, b, pairs, recordWithin);
  else
    record(pairs, a, b);
}

}  // namespace

// Stock spaces clean only what is in front of their lists, and ODE asserts that callbacks find all
// boxes up to date.
TEST_CASE("What stock sub-spaces leave dirty makes none of them dirty in callbacks", "[silent]") {
  const Triangles triangles;
  for (const bool destroyed : {false, true}) {
    const Space space;
    const dSpaceID stock = dSimpleSpaceCreate(space), ours = dParallelSAPSpaceCreate(stock),
                   inner = dSimpleSpaceCreate(ours);
    const dGeomID mesh = triangles.away.create(inner);
    setNumber(mesh, 0);
    (void)dCreateSphere(inner, 1);
    const dGeomID mover = dCreateSphere(inner, 1), front = dCreateSphere(stock, 1);
    for (const std::size_t i : {1, 2}) {  // beside each other
      const dGeomID box = dCreateBox(space, 2, 2, 2);
      dGeomSetPosition(box, kHere, real(2.5 * static_cast<double>(i) - 3.25), 0);
      setNumber(box, i);
    }
    (void)collide(space);
    dGeomTriMeshSetData(mesh, triangles.at(true));
    dGeomSetPosition(destroyed ? mesh : mover, 0, 0, 0);
    destroyed ? dGeomDestroy(mesh) : dGeomSetPosition(front, 0, 0, 0);
    Pairs pairs;
    dSpaceCollide(space, &pairs, recordWithin);
    CHECK(asSet(pairs) == (destroyed ? Pairs() : Pairs{{0, 1}, {0, 2}}));
  }
}

// dSpaceCollide2 of two spaces goes through the list of the smaller one.
TEST_CASE("ODE misses no geom of a stock sub-space whose list it goes through", "[silent]") {
  const Triangles triangles;
  for (const auto create : {dSimpleSpaceCreate, dHashSpaceCreate})
    for (const bool silently : {false, true}) {
      const Space space;
      const dSpaceID stock = create(space), inner = create(stock);
      const dGeomID meshes[] = {triangles.away.create(stock), triangles.away.create(inner)};
      for (int i = 0; i < 3; ++i) dGeomSetPosition(dCreateSphere(stock, 1), 0, 0, 0);
      for (int i = 0; i < 9; ++i) dGeomSetPosition(dCreateBox(space, 2, 2, 2), kHere, 0, 0);
      (void)collide(space);
      for (const dGeomID mesh : meshes) {
        dGeomTriMeshSetData(mesh, triangles.at(true));
        if (!silently) dGeomSetPosition(mesh, 0, 0, 0);
      }
      dGeomSetPosition(dCreateSphere(stock, 1), 0, 0, 0);
      std::size_t pairs = 0;
      struct Callback {
        static void count(void* pairs, dGeomID a, dGeomID b) {
          *static_cast<std::size_t*>(pairs) +=
              dGeomGetClass(a) == dBoxClass || dGeomGetClass(b) == dBoxClass;
        }
      };
      dSpaceCollide2(asGeom(stock), space.geom(), &pairs, Callback::count);
      INFO("silently " << silently);
      CHECK(pairs == 18);
    }
}
