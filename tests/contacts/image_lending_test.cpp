// Who has the images of ODE when: spaces, threads, processes, and what they do to geoms meanwhile.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "space/contacts/collider_threads.h"
#include "support/image_scene.h"
#include "support/ray_oracle.h"
#include "support/sanitizers.h"
#include "support/tests.h"

using namespace sap_test;
using ode_parallel_sap::ThreadColliders;

TEST_CASE("No geom is moved while its contacts with heightfields are found") {
  const ScopedGrain grain(1);
  const Space space;
  ContactScene scene(space);
  std::vector<dGeomID> boxes;
  for (std::uint64_t i = 0; i < 100; ++i) boxes.push_back(scene.add(Kind::Box, 3, seedOr(79) + i));
  for (std::uint64_t i = 0; i < 8; ++i) scene.add(Kind::Heightfield, 3, seedOr(80) + i);
  dParallelSAPSpaceSetNumThreads(space, 2);
  const Contacts expected = parallelContacts(space, 8);
  const auto before = timesOnImages();
  std::vector<std::array<dReal, 3>> places;
  for (const dGeomID box : boxes) {
    const dReal* const at = dGeomGetPosition(box);
    places.push_back({at[0], at[1], at[2]});
  }
  std::atomic<bool> done{false};
  std::atomic<long> looks{0}, moved{0};
  std::thread watcher([&] {
    for (; !done; ++looks)
      for (std::size_t i = 0; i < boxes.size(); ++i)
        moved += !std::equal(places[i].begin(), places[i].end(), dGeomGetPosition(boxes[i]));
  });
  while (looks == 0) std::this_thread::yield();
  for (int frame = 0; frame < 200; ++frame) (void)parallelContacts(space, 8);
  done = true;
  watcher.join();
  CHECK(moved == 0);
  CHECK(timesOnImages() > before);
  CHECK(difference(parallelContacts(space, 8), expected) == "");
}

TEST_CASE("Meshes are collided by several threads, a space each, as by one after the other") {
  constexpr int kSpaces = 3, kFrames = 40;
  struct Own {
    Space space;
    ContactScene scene{space};
    std::vector<dGeomID> geoms;
    Rays rays;
    Contacts expected;
    RayAnswers owed;
    std::string wrong;
  };
  const std::vector<Kind> kinds = {Kind::Torus,  Kind::Box,      Kind::CoherentTorus, Kind::Sphere,
                                   Kind::Convex, Kind::Cylinder, Kind::Capsule};
  for (const int threads : {1, 2}) {
    const ScopedGrain grain(threads == 2);
    const auto before = timesOnImages();
    std::vector<Own> all(kSpaces);
    std::uint64_t seed = seedOr(86, threads);
    for (Own& own : all) {
      for (std::size_t i = 0; i < 60; ++i)
        own.geoms.push_back(own.scene.add(kinds[i % kinds.size()], 2, ++seed));
      const dGeomID carried = dCreateTriMesh(nullptr, dGeomTriMeshGetTriMeshDataID(own.geoms[0]),
                                             nullptr, nullptr, nullptr);
      own.geoms.push_back(createTransform(own.space, carried));
      Random random(seed);
      own.rays = raysAt(own.geoms, 60, random);
      dParallelSAPSpaceSetNumThreads(own.space, threads);
      own.expected = serialContacts(own.space, {8});
      REQUIRE(!own.expected.empty());
      own.owed = owedRays(own.geoms, own.rays, 0);
    }
    std::vector<std::thread> workers;
    for (Own& own : all)
      if (&own != &all[0])
        workers.emplace_back([&own] {
          dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
          for (int frame = 0; frame < kFrames && own.wrong.empty(); ++frame)
            own.wrong = difference(parallelContacts(own.space, 8), own.expected) +
                        difference(answersOf(own.space, own.rays, 0), own.owed);
        });
    // Children use a space of their own, and must not wait for a thread that they do not have.
    pid_t child = 0;
    for (int i = 0; i < 20 && child >= 0 && !ADDRESS_SANITIZER; ++i) {
      child = fork();
      if (child == 0) {
        alarm(60);
        _exit(difference(parallelContacts(all[0].space, 8), all[0].expected) == "" ? 4 : 5);
      }
      int status = 0;
      if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status) ||
          WEXITSTATUS(status) != 4)
        child = -1;
    }
    for (std::thread& worker : workers) worker.join();
    if (ADDRESS_SANITIZER)
      WARN("SKIPPED: children of a busy process; the sanitizer's heap may stay locked in them");
    else
      CHECK(child > 0);
    for (const Own& own : all) CHECK(own.wrong == "");
    CHECK((threads == 1 || timesOnImages() > before || !meshesNeedImages()));
  }
}

namespace {

// Whether it comes to be so within a second.
template <class Condition>
bool waitFor(Condition holds) {
  const auto latest = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > latest) return false;
    std::this_thread::yield();
  }
  return true;
}

}  // namespace

TEST_CASE("A child process finds the contacts and ends, images lent or not") {
  struct Fork {
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<pid_t> child{-1};
    std::atomic<int> others{0};
    bool lent_to_others = false;
    // Of a pair that is collided on an image: the calling thread forks at its first, when another
    // of its team is at one, too, and these stay at theirs until then, or they could take all.
    static int reduce(void* data, dGeomID o1, dGeomID o2, dContactGeom*, int count) {
      Fork& own = *static_cast<Fork*>(data);
      if (dGeomGetClass(o1) != dHeightfieldClass && dGeomGetClass(o2) != dHeightfieldClass)
        return count;
      if (std::this_thread::get_id() != own.caller) {
        ++own.others;
        waitFor([&] { return own.child != -1; });
      } else if (own.child == -1) {
        own.lent_to_others = waitFor([&] { return own.others > 0; });
        const pid_t child = ADDRESS_SANITIZER ? 0 : fork();
        if (child == 0 && !ADDRESS_SANITIZER) std::exit(3);
        own.child = child;
      }
      return count;
    }
    static void contacts(void*, dGeomID, dGeomID, const dContactGeom*, int) {}
    static int endOf(pid_t child) {
      int status = 0;
      return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status)
                 ? WEXITSTATUS(status)
                 : -1;
    }
  };
  const ScopedGrain grain(1);
  const Space space;
  ContactScene scene(space);
  fillForImages(scene, seedOr(77));
  dParallelSAPSpaceSetNumThreads(space, 3);
  const Contacts expected = serialContacts(space, {8});
  REQUIRE(difference(parallelContacts(space, 8), expected) == "");

  const pid_t child = fork();
  if (child == 0) {
    alarm(60);
    const bool same = difference(parallelContacts(space, 8), expected) == "";
    const ThreadColliders images(3, 1000);  // of no use to a thread that is alone, and to be had
    _exit(same && images.count() == 3 ? 4 : 5);
  }
  CHECK(Fork::endOf(child) == 4);

  Fork in_mid_run;
  const dParallelSAPContactCallbacks callbacks = {Fork::contacts, nullptr, Fork::reduce, nullptr};
  const auto begin = std::chrono::steady_clock::now();
  dParallelSAPSpaceCollideContacts(space, &in_mid_run, 8, &callbacks);
  CHECK(in_mid_run.lent_to_others);
  if (ADDRESS_SANITIZER)
    WARN("SKIPPED: a child that exits; what its parent's threads hold are leaks to the sanitizer");
  else
    CHECK(Fork::endOf(in_mid_run.child) == 3);
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(1500));
  CHECK(difference(parallelContacts(space, 8), expected) == "");
}

// Ends the process while another thread is at a pair on an image; CTest looks at how it ends.
TEST_CASE("A program that ends waits for pairs on images", "[.][exit]") {
#if defined(__clang__)
  constexpr bool is_llvm = true;
#else
  constexpr bool is_llvm = false;
#endif
  static std::atomic<bool> at_pair{false}, was_at_pair{false};
  struct Slow {
    static int reduce(void*, dGeomID o1, dGeomID o2, dContactGeom*, int count) {
      const bool image =
          dGeomGetClass(o1) == dHeightfieldClass || dGeomGetClass(o2) == dHeightfieldClass;
      if (image && !was_at_pair.exchange(true)) {
        at_pair = true;
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        at_pair = false;
      }
      return count;
    }
    // Runs when what is in the images has been destroyed, since it was there before them.
    static void atEnd() {
      if (at_pair) _exit(9);
    }
  };
  std::atexit(Slow::atEnd);
  ode_parallel_sap::test_grain = 1;
  static const Space& space = *new Space;  // static: no leak to a sanitizer
  static ContactScene& scene = *new ContactScene(space);
  fillForImages(scene, seedOr(78));
  dParallelSAPSpaceSetNumThreads(space, 3);
  (void)parallelContacts(space, 8);
  REQUIRE(timesOnImages() > 0);
  std::thread([] {
    dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
    // LLVM's OpenMP aborts if a team starts after exit has ended it.
    while (!is_llvm || !was_at_pair)
      (void)parallelContacts(space, 8, {nullptr, nullptr, Slow::reduce, nullptr});
    for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
  }).detach();
  while (!at_pair) std::this_thread::yield();
  std::exit(0);
}
