// Bodies wherever they are in memory, and AABBTest functions. Each two classes: pairs/pairs_test.
#include <sys/mman.h>

#include <cstdlib>
#include <iterator>

#include "support/tests.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

// Lets ODE make bodies in areas 64 GiB apart, as threads' heaps may be, so that the lower 36 bits
// of their addresses are alike. Outlives all that ODE makes meanwhile.
class FarMemory {
 public:
  static constexpr int kAreas = 2;

  FarMemory() {
    void* const at = mmap(nullptr, kBytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    REQUIRE(at != MAP_FAILED);
    begin = static_cast<char*>(at);
    end = begin + kBytes;
    std::fill(std::begin(used), std::end(used), 0);
    dSetAllocHandler([](std::size_t bytes) {
      char* const at = std::exchange(next, nullptr);
      return at ? at : std::malloc(bytes);
    });
    dSetReallocHandler(
        [](void* at, std::size_t, std::size_t bytes) { return std::realloc(at, bytes); });
    dSetFreeHandler([](void* at, std::size_t) {
      if (at < begin || at >= end) std::free(at);
    });
  }
  ~FarMemory() {
    dSetAllocHandler(nullptr);
    dSetReallocHandler(nullptr);
    dSetFreeHandler(nullptr);
    munmap(begin, kBytes);
  }
  FarMemory(const FarMemory&) = delete;
  FarMemory& operator=(const FarMemory&) = delete;

  // Never the same memory twice.
  dBodyID makeBody(dWorldID world, int area) {
    next = begin + area * kDistance + kPage * used[area]++;
    REQUIRE(mprotect(next, kPage, PROT_READ | PROT_WRITE) == 0);
    return dBodyCreate(world);
  }

 private:
  static constexpr std::size_t kDistance = std::size_t{1} << 36, kBytes = kAreas * kDistance,
                               kPage = std::size_t{1} << 12;

  static char *begin, *end, *next;
  static std::size_t used[kAreas];
};
char *FarMemory::begin, *FarMemory::end, *FarMemory::next;
std::size_t FarMemory::used[];

void place(dGeomID geom, double x, double y, double z) {
  dGeomSetPosition(geom, real(x), real(y), real(z));
}

}  // namespace

TEST_CASE("Bodies far apart in memory are told apart, whatever their geoms", "[classes]") {
  FarMemory memory;
  for (const Configuration& configuration : configurations())
    for (const bool unbounded_first : {false, true}) {
      const dWorldID world = dWorldCreate();
      std::vector<dGeomID> geoms;
      INFO(configuration.name << ", unbounded first: " << unbounded_first);
      {
        const Space space(configuration);
        const dBodyID bodies[] = {memory.makeBody(world, 0), memory.makeBody(world, 1)};
        // Two on the one body, and one without bounds on the other.
        for (const bool unbounded : {unbounded_first, !unbounded_first, false}) {
          geoms.push_back(dCreateSphere(space, unbounded ? dInfinity : dReal(1)));
          dGeomSetBody(geoms.back(), bodies[unbounded]);
        }
        while (geoms.size() < 200) {
          geoms.push_back(dCreateSphere(space, 1));
          place(geoms.back(), 3.0 * static_cast<double>(geoms.size()), 50, 0);
        }
        for (std::size_t i = 0; i < geoms.size(); ++i) setNumber(geoms[i], i);
        CHECK(difference(collide(space), expectedPairs(geoms)) == "");
        // Two at rest, and one of them on a body that is awake.
        for (const std::size_t i : {100, 101}) place(geoms[i], 0, 90, 0);
        dParallelSAPSpaceSetSkipStatic(space, 1);
        const Pairs found = collide(space);
        Pairs expected = expectedPairs(geoms);
        const auto at_rest = std::find(expected.begin(), expected.end(), Pair{100, 101});
        REQUIRE(at_rest != expected.end());
        expected.erase(at_rest);
        CHECK(difference(found, expected) == "");
        dGeomSetBody(geoms[100], bodies[0]);
        place(geoms[100], 0, 90, 0);
        CHECK(difference(collide(space), expectedPairs(geoms)) == "");
      }
      dWorldDestroy(world);
    }
}

namespace {

unsigned long tests_asked = 0, test_that_drops = 0;

int dropAtOne(dGeomID, dGeomID, dReal*) {
  return ++tests_asked != test_that_drops;
}

}  // namespace

TEST_CASE("Any one AABBTest may drop its pair, and each is asked once", "[classes]") {
  constexpr std::size_t boxes = 150;
  const Space space;
  Pairs all;
  for (std::size_t i = 0; i < boxes; ++i) {
    const dReal x = real(0.75 * static_cast<double>(i));
    setNumber(createUserBox(space, {x, x + 1, 0, 1, 0, 1}, false, dropAtOne), i);
    if (i > 0) all.push_back({i - 1, i});
  }
  const unsigned long tests = 2 * all.size();
  for (const unsigned long drops : {0ul, 1ul, 2ul, 3ul, tests / 2, 0ul, tests - 1, tests, 0ul}) {
    INFO("test " << drops << " drops its pair");
    tests_asked = 0;
    test_that_drops = drops;
    Pairs expected = all;
    if (drops) expected.erase(expected.begin() + static_cast<std::ptrdiff_t>((drops - 1) / 2));
    REQUIRE(difference(collide(space), expected) == "");
    // The other one of a pair that is dropped may have been asked before.
    CHECK(tests_asked >= tests - (drops ? 1 : 0));
    CHECK(tests_asked <= tests);
  }
}
