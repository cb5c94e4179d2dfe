// Where the machine provides fewer threads than are wanted, or none. Each test is a process, since
// OpenMP keeps the threads that it has.
#include <atomic>
#include <thread>

#include "support/contact_scene.h"
#include "support/image_scene.h"
#include "support/ray_oracle.h"
#include "support/teams.h"
#include "support/tests.h"
#include "support/thread_limit.h"

using namespace sap_test;

namespace {

// Pairs, contacts and rays of frames in which eight threads are wanted everywhere; returns how many
// worked.
int threadsOfFrames() {
  const ScopedGrain grain(1);
  const Space space, space_of_contacts;
  World world(space, denseCube(400, seedOr(81)));
  ContactScene scene(space_of_contacts);
  fillForImages(scene, seedOr(82));
  for (const dSpaceID each : {dSpaceID(space), dSpaceID(space_of_contacts)}) {
    dParallelSAPSpaceSetBackend(each, dParallelSAPBackendCPU);  // a GPU's driver has threads, too
    dParallelSAPSpaceSetNumThreads(each, 8);
  }
  int threads = 0;
  for (std::uint64_t frame = 0; frame < 3; ++frame) {
    world.jitter(0.3, seedOr(83) + frame);
    REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
    threads = std::max(threads, statsOf(space).threads);
    Random random(seedOr(84) + frame);
    REQUIRE(wrongRays(space, world.geoms(), raysAt(world.geoms(), 100, random), 0) == "");
    scene.move(seedOr(85) + frame);
    const Contacts contacts = parallelContacts(space_of_contacts, 8);
    REQUIRE(difference(contacts, serialContacts(space_of_contacts, {8})) == "");
    threads = std::max(threads, statsOf(space_of_contacts).narrow_threads);
  }
  return threads;
}

}  // namespace

TEST_CASE("Where no thread can be had the calling one does all, and a message says so once",
          "[.][none]") {
  const Messages messages;
  const ThreadLimit limit(1);
  CHECK(threadsOfFrames() == 1);
  REQUIRE(messages.all().size() == 1);
  CHECK(messages.all()[0].find("provides 1 of 8 threads") != std::string::npos);
}

TEST_CASE("Where a few threads can be had they do all", "[.][few]") {
  const bool root = getuid() == 0;
  const Messages messages;
  const ThreadLimit limit(4);
  const int threads = threadsOfFrames();
  CHECK(threads <= 3);  // one is left for the rest of the program
  if (root) CHECK(threads == 3);
  CHECK(messages.all().size() == 1);
}

TEST_CASE("Where address space is short threads leave the pairs what they need", "[.][space]") {
  const Space alone, space;
  World of_one(alone, denseCube(100000, seedOr(88))), world(space, denseCube(100000, seedOr(88)));
  for (const dSpaceID each : {dSpaceID(alone), dSpaceID(space)}) {
    dParallelSAPSpaceSetBackend(each, dParallelSAPBackendCPU);  // a GPU's driver takes more
    dParallelSAPSpaceSetNumThreads(each, each == alone ? 1 : 16);
  }
  const Pairs expected = collide(alone);
  Pairs pairs;
  pairs.reserve(expected.size());
  const Messages messages;
  const AddressSpaceLimit limit(64 << 20);
  for (const bool moved : {true, false}) {
    pairs.clear();
    dSpaceCollide(space, &pairs, record);
    CHECK(difference(pairs, expected) == "");
    CHECK(statsOf(space).kept == (moved ? 0 : pairs.size()));
  }
  REQUIRE(messages.all().size() == 1);
  CHECK(messages.all()[0].find("of 16 threads") != std::string::npos);
}

TEST_CASE("Calling threads that ask at once share the threads that can be had", "[.][shared]") {
  const ScopedGrain grain(1);
  std::atomic<bool> limited{false};
  std::string wrong[3];
  std::vector<std::thread> callers;
  for (std::string& own : wrong)
    callers.emplace_back([&own, &limited] {
      while (!limited) std::this_thread::yield();
      dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
      const Space space;
      World world(space, denseCube(400, 87));
      dParallelSAPSpaceSetNumThreads(space, 8);
      for (std::uint64_t frame = 0; frame < 20; ++frame) {
        world.jitter(0.3, frame);
        own += difference(collide(space), expectedPairs(world.geoms()));
      }
    });
  const ThreadLimit limit(9);
  limited = true;
  for (std::thread& caller : callers) caller.join();
  for (const std::string& own : wrong) CHECK(own == "");
}
