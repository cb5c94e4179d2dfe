// Queries and rays, most of which several threads ask at once, of a space in which nothing changes.
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "support/mesh.h"
#include "support/ray_oracle.h"
#include "support/tests.h"
#include "support/together.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

// What one thread finds with probes of its own, also from within callbacks, as numbers.
struct Answers {
  std::vector<double> all;
  std::size_t pairs = 0;

  void add(const Pairs& found) {
    pairs += found.size();
    for (const auto& [first, second] : found)
      all.insert(all.end(), {static_cast<double>(first), static_cast<double>(second)});
    all.push_back(-1);
  }
};

Answers ask(dSpaceID space, std::uint64_t seed) {
  Random random(seed);
  Answers answers;
  const dGeomID inner = dCreateBox(nullptr, 1, 1, 1),
                probes[] = {dCreateSphere(nullptr, 1), dCreateRay(nullptr, 4)};
  setNumber(inner, 1000000);
  const auto place = [&] { return random.between(-5, 15); };
  const auto put = [&](dGeomID geom) {
    const double x = place(), y = place();
    dGeomSetPosition(geom, real(x), real(y), real(place()));
  };
  for (int round = 0; round < 60; ++round) {
    const dGeomID probe = probes[round % 2];
    setNumber(probe, 1000001);
    put(probe);
    put(inner);
    Pairs pairs, inner_pairs;
    collide2(asGeom(space), probe, [&](dGeomID a, dGeomID b) {
      record(&pairs, a, b);
      if (pairs.size() == 2) inner_pairs = collide2(space, inner);
    });
    answers.add(pairs);
    answers.add(inner_pairs);
    if (round % 8) continue;
    dParallelSAPProbe batch[2] = {{probes[0], nullptr, 0}, {inner, nullptr, 0}};
    dParallelSAPSpaceOverlaps(space, batch, 2, sizeof batch[0], 4, nullptr, nullptr);
    for (const dParallelSAPProbe& each : batch)
      answers.all.push_back(static_cast<double>(each.touched));
    Rays rays;
    while (rays.size() < 10)
      rays.push_back(
          rayOf({place(), place(), place()}, {random.gauss(), random.gauss(), random.gauss()}, 20));
    for (const dParallelSAPRayHit& hit : nearestHits(space, rays, 1))
      answers.all.insert(answers.all.end(),
                         {hit.geom ? static_cast<double>(number(hit.geom)) : -1,
                          static_cast<double>(hit.distance), static_cast<double>(hit.side)});
  }
  for (const dGeomID geom : {probes[0], probes[1], inner}) dGeomDestroy(geom);
  return answers;
}

// What threads find that ask at once, each with a ball of its own at this place.
template <class Ask>
std::vector<std::size_t> foundBy(int threads, dReal x, dReal y, dReal z, Ask ask) {
  std::vector<dGeomID> balls;
  while (balls.size() < static_cast<std::size_t>(threads)) {
    balls.push_back(dCreateSphere(nullptr, real(0.5)));
    dGeomSetPosition(balls.back(), x, y, z);
  }
  std::vector<std::size_t> found(balls.size());
  together(threads, [&](int i) { found[i] = ask(i, balls[i]); });
  for (const dGeomID ball : balls) dGeomDestroy(ball);
  return found;
}

std::size_t overlapsOf(dSpaceID space, dGeomID geom) {
  dParallelSAPProbe probe = {geom, nullptr, 0};
  return dParallelSAPSpaceOverlaps(space, &probe, 1, sizeof probe, 1, nullptr, nullptr);
}

}  // namespace

TEST_CASE(
    "Queries and rays of many threads at once, of a space and a large one in it, have one "
    "thread's answers",
    "[guests]") {
  struct Crowd {
    const Space space;
    const dSpaceID large = dParallelSAPSpaceCreate(space);
    World world{space}, within{large};

    Crowd(std::size_t n, std::uint64_t seed) {
      world.addBoxes(denseCube(n, seed));
      within.addBoxes(denseCube(n < 300 ? 300 : 2000, seed + 1));
      for (std::size_t i = 0; i < n / 8; ++i)
        world.take(createUserBox(space, {0, 1, 0, 1, 0, 1}, true, [](dGeomID, dGeomID b, dReal*) {
          return int(number(b) % 4 != 0);
        }));
    }
    Answers ask(int thread, std::uint64_t seed) const {
      return ::ask(thread % 4 == 3 ? large : dSpaceID(space),
                   seed + static_cast<std::uint64_t>(thread));
    }
  };
  const std::uint64_t seed = seedOr(901);
  constexpr int kThreads = 8;
  for (const std::size_t n : {20, 100, 300, 3000}) {
    // A twin gives one thread's answers, so that the first queries meet a space without trees.
    Crowd crowd(n, seed), twin(n, seed);
    const Messages messages;
    for (int frame = 0; frame < scaled(6); ++frame) {
      INFO(n << " geoms, frame " << frame << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      const std::uint64_t frame_seed = seed + static_cast<std::uint64_t>(100 * frame);
      for (Crowd* each : {&crowd, &twin}) {
        each->world.jitter(frame % 2 ? 0.01 : 3, frame_seed);
        each->within.jitter(frame % 2 ? 3 : 0.01, frame_seed);
        if (frame % 3 == 1) dSpaceClean(each->space);
        if (frame % 3 == 2) collide(each->space);
      }
      Answers owed[kThreads], got[kThreads];
      for (int i = 0; i < kThreads; ++i) owed[i] = twin.ask(i, frame_seed);
      together(kThreads, [&](int i) { got[i] = crowd.ask(i, frame_seed); });
      std::size_t pairs = 0;
      for (int i = 0; i < kThreads; ++i) {
        pairs += owed[i].pairs;
        REQUIRE((got[i].all == owed[i].all));
      }
      CHECK(pairs > 100);
    }
    for (const std::string& said : messages.all())
      CHECK(said.find("a thread uses it") == std::string::npos);
  }
}

TEST_CASE("All of many threads find a mesh that changed silently before they asked", "[guests]") {
  const Mesh here = tetrahedron(), there = tetrahedron(50);
  for (dSpaceID (*const make)(dSpaceID) : {dSimpleSpaceCreate, dParallelSAPSpaceCreate}) {
    const Space space;
    const dSpaceID within = make(space);
    std::vector<dGeomID> meshes;
    for (int i = 0; i < 150; ++i) {
      meshes.push_back(here.create(i % 2 ? within : dSpaceID(space)));
      dGeomSetPosition(meshes.back(), 0, real(4 * i), 0);
    }
    for (int round = 0; round < scaled(60); ++round) {
      collide(space);
      const std::size_t changed = static_cast<std::size_t>(round) % meshes.size();
      const double x = round % 2 ? 0 : 50, y = 4 * static_cast<double>(changed);
      dGeomTriMeshSetData(meshes[changed], (x > 0 ? there : here).data());
      if (round % 3 == 0) {  // something is announced, too
        dSpaceRemove(within, meshes.back());
        dSpaceAdd(within, meshes.back());
      }
      const Rays rays = {rayOf({x, y, 5}, {0, 0, -1}, 10)};
      CAPTURE(round);
      for (const std::size_t found : foundBy(6, real(x), real(y), 1, [&](int i, dGeomID ball) {
             dParallelSAPRayHit hit;
             return i % 3 == 0   ? dParallelSAPSpaceRays(space, rays.data(), 1, 0, &hit)
                    : i % 3 == 1 ? overlapsOf(space, ball)
                                 : std::size_t{!collide2(space, ball).empty()};
           }))
        REQUIRE(found == 1);
      dGeomTriMeshSetData(meshes[changed], here.data());
    }
  }
}

TEST_CASE("The first queries of a space and of one in it may come at once", "[guests]") {
  const Mesh mesh = tetrahedron(), same_mesh = tetrahedron();
  using Make = dSpaceID(dSpaceID);
  for (Make* const make : {static_cast<Make*>(nullptr), &dSimpleSpaceCreate, &dHashSpaceCreate})
    for (int round = 0; round < scaled(200); ++round) {
      const Space space;
      const dSpaceID within = dParallelSAPSpaceCreate(space);
      const dSpaceID deepest = make ? make(within) : within;
      std::vector<dGeomID> geoms;
      for (const dSpaceID own : {dSpaceID(space), within, deepest})
        for (int i = 0; i < 60; ++i) {
          geoms.push_back(i % 2 ? mesh.create(own) : dCreateBox(own, 1, 1, 1));
          dGeomSetPosition(geoms.back(), real(i < 2 ? 0 : 4 * i), 0, 0);
        }
      if (round % 3 > 0) collide(space);
      for (const dGeomID geom : geoms)
        if (round % 3 == 1)
          dGeomSetPosition(geom, dGeomGetPosition(geom)[0], 0, 0);
        else if (round % 3 == 2 && dGeomGetClass(geom) == dTriMeshClass)
          dGeomTriMeshSetData(geom, same_mesh.data());
      if (round % 3 == 2) dSpaceClean(space);
      const Messages messages;
      const auto found = foundBy(4, 0, 0, 0, [&](int i, dGeomID ball) {
        return collide2(i % 2 ? within : dSpaceID(space), ball).size();
      });
      CAPTURE(round, make != nullptr);
      // The sub-space of the asked one is a geom more.
      const std::size_t of_inner = make ? 3 : 4;
      REQUIRE(found == std::vector<std::size_t>{3, of_inner, 3, of_inner});
      REQUIRE(messages.all().empty());
    }
}

TEST_CASE("Another space may be asked about a geom that its own space brings up to date",
          "[guests]") {
  static std::atomic<int> inside, most;
  inside = most = 0;
  setUserBoundsObserver([] {
    const int now = ++inside;
    if (now > most) most = now;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    --inside;
  });
  for (int round = 0; round < scaled(20); ++round) {
    const Space space, other;
    const dGeomID geom = createUserBox(space, {0, 1, 0, 1, 0, 1});
    (void)dCreateBox(other, 1, 1, 1);
    const unsigned long before = userBoundsAsked();
    const auto found = foundBy(3, 0, 0, 0, [&](int i, dGeomID ball) {
      if (i == 0) return collide2(space, ball).size();
      if (i == 1 && round % 2) return collide2(other, geom).size();
      overlapsOf(other, i == 1 ? geom : ball);
      return std::size_t{0};
    });
    CAPTURE(round);
    CHECK(found[0] == 1);
    CHECK(found[1] == static_cast<std::size_t>(round % 2));
    CHECK(userBoundsAsked() == before + 1);
  }
  setUserBoundsObserver(nullptr);
  CHECK(most == 1);
}

TEST_CASE("Rays and probes of many threads may hit the same geom transforms", "[guests]") {
  const Space space;
  constexpr int kGeoms = 3;
  for (int i = 0; i < kGeoms; ++i) {
    const dGeomID carried = dCreateBox(nullptr, 1, 1, 1);
    dGeomSetPosition(carried, 0, 0, 5);
    dGeomSetPosition(createTransform(space, carried), real(4 * i), 0, 0);
  }
  for (const std::size_t wrong : foundBy(6, 0, 0, 0, [&](int, dGeomID ball) {
         std::size_t wrong = 0;
         for (int round = 0; round < scaled(2000); ++round) {
           const double x = 4 * (round % kGeoms);
           const Rays rays = {rayOf({x, 0, 10}, {0, 0, -1}, 20)};
           const RayHits hits = nearestHits(space, rays, 0);
           dGeomSetPosition(ball, real(x), 0, real(5.75));
           wrong += hits.empty() || hits[0].distance != real(4.5) || overlapsOf(space, ball) != 1;
         }
         return wrong;
       }))
    CHECK(wrong == 0);
}

TEST_CASE("Nobody misses threads that another calling thread has just begun to start", "[guests]") {
  const Messages messages;
  const Rays rays(500, rayOf({0, 0, 5}, {0, 0, -1}, 10));
  for (int wanted = 3; wanted < 32; ++wanted) {
    const Space spaces[4];
    for (const Space& space : spaces) {
      dParallelSAPSpaceSetNumThreads(space, wanted);
      for (int i = 0; i < 20; ++i) dCreateSphere(space, 1);
    }
    together(4, [&](int i) { nearestHits(spaces[i], rays, 0); });
  }
  CHECK(messages.all().empty());
}

TEST_CASE("A geom may be several probes of a batch", "[guests]") {
  // Its last point alone reaches the plane, and its box is long in the making.
  constexpr int kPoints = 20000;
  std::vector<dReal> points;
  for (int i = 0; i < kPoints; ++i)
    for (const dReal x : {dReal(i % 10) / 10, dReal(i + 1 < kPoints ? 1 : -1), dReal(i % 7) / 7})
      points.push_back(x);
  const dReal planes[] = {0, 1, 0, 1};
  const unsigned polygons[] = {3, 0, 1, 2};
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, 4);
  dCreatePlane(space, 0, 1, 0, dReal(-0.5));
  const dGeomID convex = dCreateConvex(nullptr, planes, 1, points.data(), kPoints, polygons);
  for (const std::size_t count : {64u, 512u}) {
    std::vector<dParallelSAPProbe> probes(count, {convex, nullptr, 0});
    for (int round = 0; round < scaled(100); ++round) {
      dGeomSetPosition(convex, 0, real(0.001 * (round % 10)), 0);
      const std::size_t touched =
          dParallelSAPSpaceOverlaps(space, probes.data(), count, sizeof probes[0],
                                    dParallelSAPOverlapAny | 1, nullptr, nullptr);
      CAPTURE(round);
      REQUIRE(touched == count);
    }
  }
  dGeomDestroy(convex);
}

TEST_CASE("A swept space and one in it may be asked at once about geoms of each other",
          "[guests]") {
  for (int round = 0; round < scaled(100); ++round) {
    const Space space;
    dParallelSAPSpaceSetSweptBounds(space, real(0.01));
    const dSpaceID within = dParallelSAPSpaceCreate(space);
    for (int i = 0; i < 100; ++i)
      for (const dSpaceID each : {dSpaceID(space), within})
        dGeomSetPosition(dCreateBox(each, 1, 1, 1), real(4 * i), 0, 0);
    const dGeomID own = dSpaceGetGeom(space, 1), inner = dSpaceGetGeom(within, 0);
    std::size_t found[2] = {};
    const Messages messages;
    together(
        2, [&](int i) { found[i] = (i ? collide2(within, own) : collide2(space, inner)).size(); });
    CAPTURE(round);
    REQUIRE(messages.all().empty());
    for (const std::size_t each : found) REQUIRE(each > 0);
  }
}

TEST_CASE("A thread may ask within a callback of a frame in which a sub-space has moved",
          "[guests]") {
  for (dSpaceID (*const make)(dSpaceID) : {dParallelSAPSpaceCreate, dSimpleSpaceCreate}) {
    const Space space;
    World world(space, onePlace(200, 1));
    const dGeomID within = dCreateBox(make(space), 1, 1, 1);
    const dGeomID probe = dCreateSphere(nullptr, 1000);
    const Messages messages;
    for (int frame = 1; frame < 4; ++frame) {
      dGeomSetPosition(within, real(0.1 * frame), 0, 0);
      std::size_t found = 0;  // within the first callback
      collide(space, [&](dGeomID, dGeomID) {
        if (!found) together(1, [&](int) { found = collide2(space, probe).size(); });
      });
      CHECK(found == 201);
    }
    CHECK(messages.all().empty());
    dGeomDestroy(probe);
  }
}

TEST_CASE("A thousand probes of a large space take a small part of dSimpleSpace's time",
          "[queries]") {
  const std::size_t n = 32000;
  const Space space;
  const dSpaceID simple = dSimpleSpaceCreate(nullptr);
  {
    World world(space, denseCube(n, 1)), twin(simple, denseCube(n, 1));
    const dGeomID probe = dCreateBox(nullptr, 1, 1, 1);
    const auto timeOf = [&](dSpaceID asked, int queries) {
      const auto begin = std::chrono::steady_clock::now();
      for (int i = 0; i < queries; ++i) {
        dGeomSetPosition(probe, real(i % 30), real(i / 30 % 30), 10);
        dSpaceCollide2(asGeom(asked), probe, nullptr, [](void*, dGeomID, dGeomID) {});
      }
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() /
             queries;
    };
    // Measured: 500 times quicker. Less is asked for, as the machine may be busy with other things.
    timeOf(space, 100);
    CHECK(timeOf(space, 1000) * 20 < timeOf(simple, 20));
    dGeomDestroy(probe);
  }
  dSpaceDestroy(simple);
}

// ThreadSanitizer sees it if two threads write the box of one of them.
TEST_CASE("Geoms that moved twice since the last query are found where they are", "[queries]") {
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, 3);
  for (int i = 0; i < 4000; ++i) dGeomSetPosition(dCreateSphere(space, 1), real(3 * i), 0, 0);
  const dGeomID probe = dCreateSphere(nullptr, 1);
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 40; ++i) CHECK(collide2(space, probe).size() == 1);
    for (const dReal height : {dReal(0.01), dReal(0)}) {
      for (int i = 0; i < 300; ++i)
        dGeomSetPosition(dSpaceGetGeom(space, i), real(3 * i), height, 0);
      dSpaceClean(space);
    }
  }
  dGeomDestroy(probe);
}

#ifdef NDEBUG  // an assertion in debug builds
TEST_CASE("A second thread that changes the space is reported once", "[guests]") {
  const Space space;
  World world(space, onePlace(200, 1));
  const auto probe = dCreateSphere(nullptr, 1000);
  const auto saysIt = [&](const std::function<void()>& change) {
    const Messages messages;
    bool done = false;
    collide2(space.geom(), probe, [&](dGeomID, dGeomID) {
      if (!std::exchange(done, true)) together(1, [&](int) { change(); });
    });
    REQUIRE(done);
    int found = 0;
    for (const std::string& said : messages.all())
      found += said.find("a thread uses it while another one does") != std::string::npos;
    return found;
  };
  collide(space);
  CHECK(saysIt([&] { collide2(space.geom(), world.geoms()[0]); }) == 0);
  CHECK(saysIt([&] { collide(space); }) == 1);
  CHECK(saysIt([&] { collide(space); }) == 0);
  dGeomDestroy(probe);
}
#endif
