// Private images of ODE: what they share with the program's and what not, and what becomes of
// contacts where there are none.
#include <dlfcn.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "space/images/ode_image.h"
#include "support/image_scene.h"
#include "support/mesh.h"
#include "support/tests.h"

using namespace sap_test;
using ode_parallel_sap::OdeImage;

namespace {

const int kTeams[] = {2, 3, 7, 16};

// Opens ODE anew, which makes its table of colliders what it was.
void reopenODE() {
  dCloseODE();
  dInitODE2(0);
  dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
}

// What is to go wrong in this process, as CTest's tests say it.
struct Fault {
  const char* name;
  const char* told;
};
constexpr Fault faults[] = {
    {"static", "not a shared library"},        {"file", "cannot be read"},
    {"memory", "no room for files in memory"}, {"load", "cannot be loaded"},
    {"contents", "not what its file holds"},   {"table", "table of colliders"}};

const Fault* expectedFault() {
  const char* const name = std::getenv("ODE_PARALLEL_SAP_TEST_IMAGE_FAULT");
  for (const Fault& fault : faults)
    if (name && fault.name == std::string(name)) return &fault;
  return nullptr;
}

const std::thread::id tests_thread = std::this_thread::get_id();

// Finds nothing on any other thread than the tests'.
int collideOverridden(dGeomID o1, dGeomID o2, int, dContactGeom* contact, int) {
  if (std::this_thread::get_id() != tests_thread) return 0;
  *contact = {};
  contact->depth = 7;
  contact->g1 = o1;
  contact->g2 = o2;
  return 1;
}

// ODE's function for memory, set for a while.
std::atomic<int> allocations{0};
void* countAllocation(std::size_t size) {
  ++allocations;
  return std::malloc(size);
}

// What a process writes to its standard error while `work` runs.
template <class Work>
std::string standardErrorOf(Work work) {
  std::FILE* const file = std::tmpfile();
  std::fflush(stderr);
  const int before = dup(STDERR_FILENO);
  dup2(fileno(file), STDERR_FILENO);
  work();
  std::fflush(stderr);
  dup2(before, STDERR_FILENO);
  close(before);
  std::rewind(file);
  std::string text(1000, '\0');
  text.resize(std::fread(&text[0], 1, text.size(), file));
  std::fclose(file);
  return text;
}

}  // namespace

TEST_CASE("Who asks for ODE by its name gets the program's") {
  static OdeImage image;
  REQUIRE(!image.load());
  const auto program = ode_parallel_sap::libraryAt(dGetConfiguration());
  void* const named = dlopen(program.path.c_str(), RTLD_NOW | RTLD_NOLOAD);
  REQUIRE(named);
  CHECK(dlsym(named, "dGetConfiguration") != image.symbol("dGetConfiguration"));
  const char* const file = program.path.c_str() + program.path.rfind('/') + 1;
  void* const by_soname = dlopen(file, RTLD_NOW | RTLD_NOLOAD);
  REQUIRE(by_soname);
  CHECK(dlsym(by_soname, "dGetConfiguration") == dlsym(named, "dGetConfiguration"));
}

TEST_CASE("What an image reports is the program's to hear") {
  static OdeImage image;
  REQUIRE(!image.load());
  using Tell = void (*)(int, const char*, ...);
  const auto message = reinterpret_cast<Tell>(image.symbol("dMessage"));
  const auto error = reinterpret_cast<Tell>(image.symbol("dError"));
  const auto debug = reinterpret_cast<Tell>(image.symbol("dDebug"));
  {
    const Messages messages;
    message(5, "%d of %s", 7, "nine");
    CHECK(messages.all() == std::vector<std::string>{"7 of nine"});
  }
  CHECK_THROWS_AS(error(1, "an error"), OdeAssertion);
  CHECK_THROWS_AS(debug(1, "a bug"), OdeAssertion);
  // Without a function of the program's it is ODE's own way to say it.
  REQUIRE(dGetMessageHandler() == nullptr);
  const std::string text = standardErrorOf([&] { message(5, "%d%%", 7); });
  CHECK(text == "\nODE Message 5: 7%\n");
}

TEST_CASE("What fails in a collider of an image leaves the call") {
  if (!odeHasAssertions() || !meshesNeedImages()) return;
  const ScopedGrain grain(1);
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, 3);
  ContactScene scene(space);
  scene.fill({Kind::Convex}, 40, seedOr(71));
  // Without what the collider of convexes asks meshes for.
  const Mesh plain({-2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2, 0}, {0, 1, 2, 0, 2, 3});
  std::vector<dGeomID> meshes;
  for (int i = 0; i < 6; ++i) meshes.push_back(plain.create(space));
  for (const dGeomID mesh : meshes) dGeomSetPosition(mesh, 1, 1, 1);
  for (int frame = 0; frame < 3; ++frame) {
    const auto before = timesOnImages();
    CHECK_THROWS_AS(parallelContacts(space, 8), OdeAssertion);
    CHECK(timesOnImages() > before);
  }
  for (const dGeomID mesh : meshes) dGeomDestroy(mesh);
  CHECK_NOTHROW(parallelContacts(space, 8));
}

TEST_CASE("What an image allocates is not the program's memory") {
  const ScopedGrain grain(1);
  const Space space;
  ContactScene scene(space);
  fillForImages(scene, seedOr(72));
  dParallelSAPSpaceSetNumThreads(space, 7);
  (void)parallelContacts(space, 8);
  const auto before = timesOnImages();
  const Contacts expected = serialContacts(space, {8});
  reopenODE();  // frees the cache of the program's colliders
  dSetAllocHandler(countAllocation);
  CHECK(difference(parallelContacts(space, 8), expected) == "");
  if (meshesNeedImages()) CHECK(allocations == 0);
  CHECK(difference(serialContacts(space, {8}), expected) == "");
  CHECK(allocations > 0);
  dSetAllocHandler(nullptr);
  CHECK(timesOnImages() > before);
}

TEST_CASE("Overridden colliders run on the calling thread, until they are not overridden") {
  const ScopedGrain grain(1);
  const Space space;
  ContactScene scene(space);
  fillForImages(scene, seedOr(73));
  const Contacts before = serialContacts(space, {8});
  for (const int other : {dSphereClass, dHeightfieldClass, dTriMeshClass}) {
    dSetColliderOverride(meshesNeedImages() ? dTriMeshClass : dHeightfieldClass,
                         meshesNeedImages() ? other : dSphereClass, collideOverridden);
    const Contacts expected = serialContacts(space, {8});
    REQUIRE(difference(before, expected) != "");
    for (const int threads : kTeams) {
      INFO(threads << " threads, class " << other);
      dParallelSAPSpaceSetNumThreads(space, threads);
      REQUIRE(difference(parallelContacts(space, 8), expected) == "");
    }
    reopenODE();
    REQUIRE(difference(parallelContacts(space, 8), before) == "");
  }
}

TEST_CASE("Contacts are those of the serial loop with images and, whatever fails, without",
          "[fault]") {
  const ScopedGrain grain(1);
  const Fault* const fault = expectedFault();
  const Messages messages;
  const auto before = timesOnImages();
  for (int round = 0; round < 2; ++round)
    for (const int threads : kTeams) {
      const Space space;
      ContactScene scene(space);
      fillForImages(scene, seedOr(74));
      dParallelSAPSpaceSetNumThreads(space, threads);
      for (std::uint64_t frame = 0; frame < 2; ++frame) {
        scene.move(seedOr(75) + frame);
        INFO(threads << " threads, frame " << frame);
        const Contacts expected = serialContacts(space, {8});
        REQUIRE(expected.size() > 500);
        REQUIRE(difference(parallelContacts(space, 8), expected) == "");
      }
    }
  std::vector<std::string> said;
  for (const std::string& text : messages.all())
    if (text.find("parallel SAP space") == 0) said.push_back(text);
  CHECK((timesOnImages() > before) == !fault);
  REQUIRE(said.size() == (fault ? 1 : 0));
  if (fault) CHECK(said[0].find(fault->told) != std::string::npos);
}
