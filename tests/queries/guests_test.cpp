// Queries and rays that several threads ask at once, of a space in which nothing changes.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <vector>

#include "support/bounds.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/mesh.h"
#include "support/ode_errors.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

// What one thread finds with probes of its own.
struct Answers {
  std::vector<Pairs> pairs;
  std::vector<dParallelSAPRayHit> hits;
  std::vector<std::size_t> touched;
};

bool same(const dParallelSAPRayHit& a, const dParallelSAPRayHit& b) {
  return a.geom == b.geom && a.distance == b.distance && a.side == b.side;
}

std::string difference(const Answers& got, const Answers& owed) {
  for (std::size_t i = 0; i < owed.pairs.size(); ++i) {
    const std::string wrong = sap_test::difference(got.pairs[i], owed.pairs[i]);
    if (wrong != "") return "query " + std::to_string(i) + ": " + wrong;
  }
  for (std::size_t i = 0; i < owed.hits.size(); ++i)
    if (!same(got.hits[i], owed.hits[i])) return "another hit of ray " + std::to_string(i);
  return got.touched == owed.touched ? "" : "other overlaps of a probe";
}

// Also from within callbacks.
Answers ask(dSpaceID space, const Bounds& around, std::uint64_t seed, int rounds) {
  struct Nest {
    dGeomID space, inner;
    Pairs pairs, inner_pairs;
  } nest{};
  Random random(seed);
  Answers answers;
  const dGeomID probes[] = {dCreateSphere(nullptr, 1), dCreateRay(nullptr, 4)};
  nest.space = asGeom(space);
  nest.inner = dCreateBox(nullptr, 1, 1, 1);
  setNumber(nest.inner, 1000000);
  const auto put = [&](dGeomID geom) {
    dGeomSetPosition(geom, static_cast<dReal>(random.between(around[0], around[1])),
                     static_cast<dReal>(random.between(around[2], around[3])),
                     static_cast<dReal>(random.between(around[4], around[5])));
  };
  for (int round = 0; round < rounds; ++round) {
    const dGeomID probe = probes[round % 2];
    setNumber(probe, 1000001);
    put(probe);
    put(nest.inner);
    nest.pairs.clear();
    nest.inner_pairs.clear();
    dSpaceCollide2(nest.space, probe, &nest, [](void* data, dGeomID a, dGeomID b) {
      Nest& own = *static_cast<Nest*>(data);
      own.pairs.emplace_back(number(a), number(b));
      if (own.pairs.size() == 2) collide2(own.space, own.inner).swap(own.inner_pairs);
    });
    answers.pairs.push_back(nest.pairs);
    answers.pairs.push_back(nest.inner_pairs);
    if (round % 8) continue;
    dParallelSAPProbe batch[2] = {{probes[0], nullptr, 0}, {nest.inner, nullptr, 0}};
    dParallelSAPSpaceOverlaps(space, batch, 2, sizeof batch[0], 4, nullptr, nullptr);
    for (const dParallelSAPProbe& each : batch) answers.touched.push_back(each.touched);
    dParallelSAPRay rays[10] = {};
    for (dParallelSAPRay& ray : rays) {
      for (int axis = 0; axis < 3; ++axis) {
        ray.origin[axis] =
            static_cast<dReal>(random.between(around[2 * axis], around[2 * axis + 1]));
        ray.direction[axis] = static_cast<dReal>(random.gauss());
      }
      ray.length = 20;
    }
    answers.hits.resize(answers.hits.size() + 10);
    dParallelSAPSpaceRays(space, rays, 10, 1, &answers.hits[answers.hits.size() - 10]);
  }
  for (const dGeomID geom : {probes[0], probes[1], nest.inner}) dGeomDestroy(geom);
  return answers;
}

void together(int threads, const std::function<void(int)>& work) {
  std::vector<std::thread> workers;
  for (int i = 0; i < threads; ++i)
    workers.emplace_back([&, i] {
      if (dAllocateODEDataForThread(dAllocateMaskAll)) work(i);
      dCleanupODEAllDataForThread();
    });
  for (std::thread& worker : workers) worker.join();
}

// Another thread asks of a probe within the first callback.
struct AskWithin {
  dGeomID space, probe;
  std::size_t found = 0;

  static void call(void* data, dGeomID, dGeomID) {
    AskWithin& own = *static_cast<AskWithin*>(data);
    if (!own.found) together(1, [&](int) { own.found = collide2(own.space, own.probe).size(); });
  }
};

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
      const dSpaceID asked = thread % 4 == 3 ? large : dSpaceID(space);
      return ::ask(asked, {-5, 15, -5, 15, -5, 15}, seed + static_cast<std::uint64_t>(thread), 60);
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
      std::vector<Answers> owed(kThreads), got(kThreads);
      for (int i = 0; i < kThreads; ++i)
        owed[static_cast<std::size_t>(i)] = twin.ask(i, frame_seed);
      together(kThreads,
               [&](int i) { got[static_cast<std::size_t>(i)] = crowd.ask(i, frame_seed); });
      std::size_t pairs = 0;
      for (std::size_t i = 0; i < kThreads; ++i) {
        for (const Pairs& each : owed[i].pairs) pairs += each.size();
        // The hits of the twin are its own geoms.
        for (std::vector<dParallelSAPRayHit>* hits : {&owed[i].hits, &got[i].hits})
          for (dParallelSAPRayHit& hit : *hits)
            if (hit.geom) hit.geom = reinterpret_cast<dGeomID>(number(hit.geom) + 1);
        REQUIRE(difference(got[i], owed[i]) == "");
      }
      CHECK(pairs > 100);
    }
    for (const std::string& said : messages.all())
      CHECK(said.find("a thread uses it") == std::string::npos);
  }
}

TEST_CASE("All of many threads find a mesh that changed silently before they asked", "[guests]") {
  // The same tetrahedron here and there.
  const std::vector<dTriIndex> faces = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  const Mesh here({-1, -1, -1, 1, -1, -1, 0, 1, -1, 0, 0, 1}, faces),
      there({49, -1, -1, 51, -1, -1, 50, 1, -1, 50, 0, 1}, faces);
  for (dSpaceID (*const make)(dSpaceID) : {dSimpleSpaceCreate, dParallelSAPSpaceCreate}) {
    const Space space;
    const dSpaceID within = make(space);
    std::vector<dGeomID> meshes;
    for (int i = 0; i < 150; ++i) {
      meshes.push_back(here.create(i % 2 ? within : dSpaceID(space)));
      dGeomSetPosition(meshes.back(), 0, static_cast<dReal>(4 * i), 0);
    }
    for (int round = 0; round < scaled(60); ++round) {
      collide(space);
      const std::size_t changed = static_cast<std::size_t>(round) % meshes.size();
      const dReal x = round % 2 ? 0 : 50, y = static_cast<dReal>(4 * changed);
      dGeomTriMeshSetData(meshes[changed], (x > 0 ? there : here).data());
      if (round % 3 == 0) {  // something is announced, too
        dSpaceRemove(within, meshes.back());
        dSpaceAdd(within, meshes.back());
      }
      constexpr int kThreads = 6;
      std::size_t found[kThreads] = {};
      std::atomic<int> ready{0};
      together(kThreads, [&](int i) {
        const dGeomID ball = dCreateSphere(nullptr, dReal(0.5));
        dGeomSetPosition(ball, x, y, 1);
        const dParallelSAPRay ray = {{x, y, 5, 0}, {0, 0, -1, 0}, 10, 0, 0, nullptr};
        dParallelSAPRayHit hit;
        dParallelSAPProbe probe = {ball, nullptr, 0};
        for (++ready; ready < kThreads;) std::this_thread::yield();
        found[i] = i % 3 == 0   ? dParallelSAPSpaceRays(space, &ray, 1, 0, &hit)
                   : i % 3 == 1 ? dParallelSAPSpaceOverlaps(space, &probe, 1, sizeof probe, 0,
                                                            nullptr, nullptr)
                                : !collide2(space, ball).empty();
        dGeomDestroy(ball);
      });
      CAPTURE(round);
      for (const std::size_t each : found) REQUIRE(each == 1);
      dGeomTriMeshSetData(meshes[changed], here.data());
    }
  }
}

TEST_CASE("The first queries of a space and of one in it may come at once", "[guests]") {
  // A tetrahedron that the ball touches, and the same one again.
  const std::vector<dTriIndex> faces = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  const std::vector<float> corners = {-1, -1, -1, 1, -1, -1, 0, 1, -1, 0, 0, 1};
  const Mesh mesh(corners, faces), same_mesh(corners, faces);
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
          dGeomSetPosition(geoms.back(), static_cast<dReal>(i < 2 ? 0 : 4 * i), 0, 0);
        }
      if (round % 3 > 0) collide(space);
      for (const dGeomID geom : geoms)
        if (round % 3 == 1)
          dGeomSetPosition(geom, dGeomGetPosition(geom)[0], 0, 0);
        else if (round % 3 == 2 && dGeomGetClass(geom) == dTriMeshClass)
          dGeomTriMeshSetData(geom, same_mesh.data());
      if (round % 3 == 2) dSpaceClean(space);
      constexpr int kThreads = 4;
      std::size_t found[kThreads] = {};
      std::atomic<int> ready{0};
      const Messages messages;
      together(kThreads, [&](int i) {
        const dGeomID ball = dCreateSphere(nullptr, dReal(0.5));
        const dGeomID asked = asGeom(i % 2 ? within : dSpaceID(space));
        for (++ready; ready < kThreads;) std::this_thread::yield();
        found[i] = collide2(asked, ball).size();
        dGeomDestroy(ball);
      });
      CAPTURE(round, make != nullptr);
      // The sub-space of the asked one is a geom more.
      for (int i = 0; i < kThreads; ++i) REQUIRE(found[i] == (i % 2 && !make ? 4 : 3));
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
    std::size_t found[2] = {};
    std::atomic<int> ready{0};
    const unsigned long before = userBoundsAsked();
    together(3, [&](int i) {
      const dGeomID ball = dCreateSphere(nullptr, dReal(0.5));
      dParallelSAPProbe probe = {i == 1 ? geom : ball, nullptr, 0};
      for (++ready; ready < 3;) std::this_thread::yield();
      if (i == 0)
        found[0] = collide2(space, ball).size();
      else if (i == 1 && round % 2)
        found[1] = collide2(other, geom).size();
      else
        dParallelSAPSpaceOverlaps(other, &probe, 1, sizeof probe, 1, nullptr, nullptr);
      dGeomDestroy(ball);
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
  constexpr int kGeoms = 3, kThreads = 6;
  for (int i = 0; i < kGeoms; ++i) {
    const dGeomID carried = dCreateBox(nullptr, 1, 1, 1);
    dGeomSetPosition(carried, 0, 0, 5);
    dGeomSetPosition(createTransform(space, carried), static_cast<dReal>(4 * i), 0, 0);
  }
  std::atomic<int> wrong{0};
  together(kThreads, [&](int) {
    const dGeomID ball = dCreateSphere(nullptr, dReal(0.75));
    for (int round = 0; round < scaled(2000); ++round) {
      const dReal x = static_cast<dReal>(4 * (round % kGeoms));
      const dParallelSAPRay ray = {{x, 0, 10, 0}, {0, 0, -1, 0}, 20, 0, 0, nullptr};
      dParallelSAPRayHit hit;
      dParallelSAPSpaceRays(space, &ray, 1, 0, &hit);
      dGeomSetPosition(ball, x, 0, 6);
      dParallelSAPProbe probe = {ball, nullptr, 0};
      dParallelSAPSpaceOverlaps(space, &probe, 1, sizeof probe, 1, nullptr, nullptr);
      wrong += !hit.geom || hit.distance != dReal(4.5) || probe.touched != 1;
    }
    dGeomDestroy(ball);
  });
  CHECK(wrong == 0);
}

TEST_CASE("Nobody misses threads that another calling thread has just begun to start", "[guests]") {
  constexpr int kCalling = 4;
  const Messages messages;
  for (int wanted = 3; wanted < 32; ++wanted) {
    std::atomic<int> ready{0};
    together(kCalling, [&](int) {
      const Space space;
      dParallelSAPSpaceSetNumThreads(space, wanted);
      for (int i = 0; i < 20; ++i) dCreateSphere(space, 1);
      std::vector<dParallelSAPRay> rays(500, {{0, 0, 5, 0}, {0, 0, -1, 0}, 10, 0, 0, nullptr});
      std::vector<dParallelSAPRayHit> hits(rays.size());
      for (++ready; ready < kCalling;) std::this_thread::yield();
      dParallelSAPSpaceRays(space, rays.data(), rays.size(), 0, hits.data());
    });
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
      dGeomSetPosition(convex, 0, static_cast<dReal>(0.001 * (round % 10)), 0);
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
    dParallelSAPSpaceSetSweptBounds(space, dReal(0.01));
    const dSpaceID within = dParallelSAPSpaceCreate(space);
    for (int i = 0; i < 100; ++i)
      for (const dSpaceID each : {dSpaceID(space), within})
        dGeomSetPosition(dCreateBox(each, 1, 1, 1), static_cast<dReal>(4 * i), 0, 0);
    const dGeomID own = dSpaceGetGeom(space, 1), inner = dSpaceGetGeom(within, 0);
    std::size_t found[2] = {};
    std::atomic<int> ready{0};
    const Messages messages;
    together(2, [&](int i) {
      for (++ready; ready < 2;) std::this_thread::yield();
      found[i] = (i ? collide2(asGeom(within), own) : collide2(asGeom(space), inner)).size();
    });
    CAPTURE(round);
    REQUIRE(messages.all().empty());
    for (const std::size_t each : found) REQUIRE(each > 0);
  }
}

TEST_CASE("A thread may ask within a callback of a frame in which a sub-space has moved",
          "[guests]") {
  for (dSpaceID (*const make)(dSpaceID) : {dParallelSAPSpaceCreate, dSimpleSpaceCreate}) {
    const Space space;
    World world(space);
    world.addBoxes(onePlace(200, 1));
    const dGeomID within = dCreateBox(make(space), 1, 1, 1);
    const dGeomID probe = dCreateSphere(nullptr, 1000);
    const Messages messages;
    for (int frame = 1; frame < 4; ++frame) {
      dGeomSetPosition(within, static_cast<dReal>(0.1 * frame), 0, 0);
      AskWithin ask = {space.geom(), probe};
      dSpaceCollide(space, &ask, AskWithin::call);
      CHECK(ask.found == 201);
    }
    CHECK(messages.all().empty());
    dGeomDestroy(probe);
  }
}

#ifdef NDEBUG  // an assertion in debug builds
TEST_CASE("A second thread that changes the space is reported once", "[guests]") {
  const Space space;
  World world(space);
  world.addBoxes(onePlace(200, 1));
  const auto probe = dCreateSphere(nullptr, 1000);
  const auto saysIt = [&](const std::function<void()>& change) {
    const Messages messages;
    static const std::function<void()>* now;
    static bool done;
    now = &change;
    done = false;
    dSpaceCollide2(space.geom(), probe, nullptr, [](void*, dGeomID, dGeomID) {
      if (done) return;
      done = true;
      together(1, [](int) { (*now)(); });
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
