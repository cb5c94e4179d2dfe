// Meshes whose triangles change without a word to any space: dGeomTriMeshSetData tells none.
#include "support/calls.h"
#include "support/mesh.h"
#include "support/ray_oracle.h"
#include "support/tests.h"

using namespace sap_test;

namespace {

constexpr dReal kHere = 100;

// One triangle at each place, from x to x + 1; the second one is here.
struct Triangles {
  const Mesh away{{170, 0, 0, 171, 0, 0, 170, 1, 1}, {0, 1, 2}},
      here{{100, 0, 0, 101, 0, 0, 100, 1, 1}, {0, 1, 2}};

  dTriMeshDataID at(bool place) const { return (place ? here : away).data(); }
};

// How much a call tells, a sphere that the probe and the ray meet too.
struct Told {
  std::size_t count = 0;
  void operator()(const dParallelSAPPair*, std::size_t pairs, std::size_t) { count += pairs; }
  void operator()(std::size_t, const dParallelSAPRayHit*, std::size_t hits) { count += hits; }
  template <class... Report>
  void operator()(Report...) {
    ++count;
  }
};
std::size_t toldBy(int call, dSpaceID space, dGeomID probe) {
  Told told;
  report(static_cast<Call>(call), space, {probe, rayOf({kHere + 0.3, 0.25, 5}, {0, 0, -1}, 10)},
         told);
  return told.count;
}

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
    for (int call = 0; call < kCalls; ++call) {
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
      collide2(asGeom(stock), space.geom(), [&](dGeomID a, dGeomID b) {
        pairs += dGeomGetClass(a) == dBoxClass || dGeomGetClass(b) == dBoxClass;
      });
      INFO("silently " << silently);
      CHECK(pairs == 18);
    }
}
