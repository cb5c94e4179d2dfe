// dParallelSAPSpaceCollideContacts gives what a serial loop over dCollide gives.
#include <cstdlib>
#include <set>

#include "support/contact_scene.h"
#include "support/tests.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

const int kThreads[] = {1, 2, 3, 7, 16};

std::vector<Kind> allKinds() {
  std::vector<Kind> kinds;
  for (int kind = 0; kind < static_cast<int>(Kind::Heightfield); ++kind)
    kinds.push_back(static_cast<Kind>(kind));
  return kinds;
}

// All of ODE in one heap, on terrain and a plane.
void fillWithAll(ContactScene& scene, std::size_t n, std::uint64_t seed) {
  scene.add(Kind::Plane, 0, seed);
  scene.fill(allKinds(), n, seed);
  for (std::uint64_t i = 0; i < 3; ++i) scene.add(Kind::Heightfield, 6, seed + i);
  for (const Kind kind : {Kind::FixedHeightfield, Kind::CalledHeightfield})
    scene.add(kind, 6, seed);
}

// As ODE's own without libccd, says nothing of the sides.
int collideWithoutSides(dGeomID o1, dGeomID o2, int, dContactGeom* contact, int) {
  contact->pos[0] = contact->pos[1] = contact->pos[2] = 0;
  contact->normal[0] = contact->normal[1] = contact->normal[2] = contact->depth = 1;
  contact->g1 = o1;
  contact->g2 = o2;
  return 1;
}

}  // namespace

TEST_CASE(
    "Contacts of a heap of every two classes are those of the serial loop while all moves, and "
    "the program's own colliders and callbacks run on the calling thread",
    "[narrow]") {
  const std::uint64_t seed = seedOr(82);
  std::set<std::pair<int, int>> met;
  userCodeCalls();
  userCodeKeptToThisThread();
  for (const Configuration& configuration : configurations()) {
    const Space space(configuration);
    ContactScene scene(space);
    fillWithAll(scene, 600, seed);
    for (std::uint64_t frame = 0; frame < static_cast<std::uint64_t>(scaled(2)); ++frame)
      for (const int threads : kThreads) {
        scene.move(seed + 10 * frame);
        dParallelSAPSpaceSetNumThreads(space, threads);
        const Contacts got = parallelContacts(space, 20);
        INFO(configuration.name << ", " << threads << " threads, frame " << frame
                                << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        REQUIRE(got.size() > 1000);
        REQUIRE(statsOf(space).contacts == got.size());
        REQUIRE(difference(got, serialContacts(space, {20})) == "");
        for (const Contact& contact : got)
          met.insert({dGeomGetClass(contact.o1), dGeomGetClass(contact.o2)});
      }
  }
  CHECK(met.size() > 60);  // ordered pairs of classes that have a collider
  CHECK(userCodeCalls() > 100);
  CHECK(userCodeKeptToThisThread());
}

TEST_CASE("The threads of pairs and of contacts are told apart", "[narrow]") {
  const Space space;
  ContactScene scene(space);
  scene.fill({Kind::Box}, 900, seedOr(84));  // many pairs of few geoms
  dParallelSAPSpaceSetNumThreads(space, 3);
  const auto contactsOf = [&] { return parallelContacts(space, 8).size(); };
  for (int frame = 0; frame < 4; ++frame) CHECK(contactsOf() > 0);
  const dParallelSAPStats both = statsOf(space);
  // With a grain of 1 few geoms are work for all.
  const int finding = std::getenv("ODE_PARALLEL_SAP_TEST_GRAIN") ? 3 : 1;
  CHECK(both.find_threads == finding);
  CHECK(both.narrow_threads == 3);
  CHECK(both.threads == 3);
  dSpaceCollide(space, nullptr, [](void*, dGeomID, dGeomID) {});
  CHECK(statsOf(space).find_threads == finding);
  CHECK(statsOf(space).narrow_threads == 0);
  CHECK(statsOf(space).threads == finding);
}

TEST_CASE("Bounds of added geoms are up to date before other threads may ask for them",
          "[narrow]") {
  struct Added {
    std::vector<dGeomID> geoms;
    unsigned long asked = 0;
    static void spaces(void* data, dGeomID, dGeomID, void* pairs) {
      Added& own = *static_cast<Added*>(data);
      for (std::size_t i = 0; i < own.geoms.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) dParallelSAPAddPair(pairs, own.geoms[i], own.geoms[j]);
      own.asked = userBoundsAsked();
    }
    static int flags(void*, dGeomID o1, dGeomID o2) {
      dReal bounds[6];
      dGeomGetAABB(o1, bounds);
      dGeomGetAABB(o2, bounds);
      return 0;
    }
    static void contacts(void*, dGeomID, dGeomID, const dContactGeom*, int) {}
  };
  const Space space;
  dCreateSphere(dSimpleSpaceCreate(space), 1);
  dCreateSphere(space, 1);
  Added added;
  for (int i = 0; i < 40; ++i) added.geoms.push_back(createUserBox(nullptr, {0, 1, 0, 1, 0, 1}));
  dParallelSAPSpaceSetNumThreads(space, 3);
  const unsigned long before = userBoundsAsked();
  const dParallelSAPContactCallbacks callbacks = {Added::contacts, Added::flags, nullptr,
                                                  Added::spaces};
  dParallelSAPSpaceCollideContacts(space, &added, 8, &callbacks);
  CHECK(added.asked == before + added.geoms.size());
  CHECK(userBoundsAsked() == added.asked);
  for (const dGeomID geom : added.geoms) dGeomDestroy(geom);
}

TEST_CASE(
    "Sides that the collider of two convexes says nothing of are none, whatever was collided "
    "before",
    "[narrow]") {
  {
    const Space space;
    ContactScene scene(space);
    scene.fill({Kind::Torus, Kind::Convex}, 300, seedOr(92));
    dSetColliderOverride(dConvexClass, dConvexClass, collideWithoutSides);
    for (const int threads : kThreads) {
      dParallelSAPSpaceSetNumThreads(space, threads);
      int of_convexes = 0, of_meshes = 0;
      for (const Contact& contact : parallelContacts(space, 8)) {
        const bool convexes =
            dGeomGetClass(contact.o1) == dConvexClass && dGeomGetClass(contact.o2) == dConvexClass;
        ++(convexes ? of_convexes : of_meshes);
        if (!convexes) continue;
        REQUIRE(contact.side1 == -1);
        REQUIRE(contact.side2 == -1);
      }
      CHECK(of_convexes > 50);
      CHECK(of_meshes > 50);  // whose contacts have sides
    }
  }
  dCloseODE();  // and the override with it
  REQUIRE(dInitODE2(0));
  REQUIRE(dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll)));
}

TEST_CASE("Threads of a manually cleaned ODE leave nothing behind and collide all the same",
          "[narrow]") {
  REQUIRE(dInitODE2(dInitFlagManualThreadCleanup));
  REQUIRE(dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll)));
  {
    const Space space;
    dSpaceSetManualCleanup(space, 1);
    ContactScene scene(space);
    // ODE's heightfields and geom transforms do not work in this mode: the rays and geoms within
    // them are in no space.
    scene.fill({Kind::Torus, Kind::Box, Kind::Sphere, Kind::Convex}, 600, seedOr(91));
    const Contacts expected = serialContacts(space, {8});
    dParallelSAPSpaceSetNumThreads(space, 3);
    for (int frame = 0; frame < 3; ++frame)
      REQUIRE(difference(parallelContacts(space, 8), expected) == "");
  }
  dCleanupODEAllDataForThread();
  dCloseODE();
}
