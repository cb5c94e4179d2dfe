// Which devices are used where some have no room, and that nothing is asked of the others: on
// emulated ones (emulation/runtime.h). In most tests kernels do nothing, so frames have no pairs.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdarg>
#include <cstdlib>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>

#include "cuda/device/fault_injection.h"
#include "cuda/finder/cuda_sweep.h"
#include "cuda/finder/device_pool.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/teams.h"
#include "support/thread_limit.h"
#include "support/variable.h"
#include "tests/gpu/emulation/runtime.h"

using namespace ode_parallel_sap;
using emulation::failAllocation;

namespace {

// Before main() asks for devices, as the driver is asked once. Each machine is a process.
const std::string machine = [] {
  const char* const text = std::getenv("ODE_PARALLEL_SAP_TEST_MACHINE");
  const std::string devices = text ? text : "";
  emulation::setDevices(devices);
  using std::chrono::milliseconds;
  ode_parallel_sap::setMemoryRetry(devices == "fff" ? milliseconds(20) : std::chrono::hours(1));
  return devices;
}();

struct Scene {
  sap_test::Space space;
  sap_test::World world{space};

  explicit Scene(int backend, int devices = 0, std::size_t boxes = 3000,
                 int method = dParallelSAPMethodSweep) {
    REQUIRE(dParallelSAPSpaceSetBackend(space, backend));
    REQUIRE(dParallelSAPSpaceSetMethod(space, method));
    dParallelSAPSpaceSetNumDevices(space, devices);
    world.addBoxes(sap_test::denseCube(boxes, 5));
  }
  dParallelSAPStats collide(int frames = 1) {
    while (frames-- > 0) {
      world.jitter(0.1, ++frame_);  // all move: each frame is found anew
      const sap_test::Pairs pairs = sap_test::collide(space);
      if (emulation::settings().kernels_run)
        REQUIRE(sap_test::difference(pairs, sap_test::expectedPairs(world.geoms())) == "");
    }
    return statsOf(space);
  }

 private:
  std::uint64_t frame_ = 0;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// Waits until a condition is met. Whether it is within so many seconds.
template <class Condition>
bool isMetWithin(int seconds, Condition condition) {
  const auto latest = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > latest) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

bool comesToDevices(Scene& scene, int devices) {
  return isMetWithin(10, [&] { return scene.collide().devices == devices; });
}

// Frames until devices are used, at most 500.
int devicesThatAutoComesTo(Scene& scene) {
  dParallelSAPSpaceSetNumThreads(scene.space, 1);  // the fake devices are faster
  for (int frame = 0; frame < 500; ++frame)
    if (const int devices = scene.collide().devices) return devices;
  return 0;
}

int freeDevices() {
  return static_cast<int>(std::count(machine.begin(), machine.end(), '-'));
}

// Nothing is left on any device, and no call was made without a context.
void checkAllGivenBack() {
  for (std::size_t i = 0; i < machine.size(); ++i)
    CHECK(emulation::device(static_cast<int>(i)).in_use == 0);
  CHECK(emulation::callsWithoutContext() == 0);
}

// Whether work() is true in a child of this process, which then ends.
template <class Work>
bool isTrueInChild(Work work) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(20);
    std::exit(work() ? 0 : 1);
  }
  int status = 1;
  return waitpid(child, &status, 0) == child && status == 0;
}

// Each full device was tried and named once, and all others had work.
void checkFullOnes(const sap_test::Messages& messages) {
  std::size_t named = 0;
  for (std::size_t i = 0; i < machine.size(); ++i) {
    const emulation::Device device = emulation::device(static_cast<int>(i));
    if (machine[i] != 'f') {
      CHECK(device.launches > 0);
      continue;
    }
    CHECK(device.tried == 1);
    REQUIRE(named < messages.all().size());
    const std::string& message = messages.all()[named++];
    CHECK(contains(message, "GPU " + std::to_string(i) + " cannot be used ("));
    CHECK(contains(message, "out of memory"));
  }
  REQUIRE(messages.all().size() == named);
  const std::string left = "GPUs left: " + std::to_string(freeDevices());
  CHECK(contains(messages.all().back(), freeDevices() ? left : "on the CPU until there is memory"));
}

}  // namespace

TEST_CASE("On a machine without a device that will do frames stay on the CPU",
          "[.][no-driver][no-device][old-device]") {
  std::string why;
  CHECK(ode_parallel_sap::cudaDevices(&why).empty());
  CHECK(contains(why, machine == "no-driver" ? "no driver"
                      : machine == "x"       ? "too old: compute capability 5.0"
                                             : "no device"));
  const sap_test::Messages messages;
  Scene scene(dParallelSAPBackendAuto, 0, 20000);
  CHECK(dParallelSAPSpaceSetBackend(scene.space, dParallelSAPBackendCUDA) == 0);
  // Long enough for Auto to look for a device.
  for (int frame = 0; frame < 30; ++frame) CHECK(scene.collide().pairs > 0);
  CHECK(statsOf(scene.space).backend == dParallelSAPBackendCPU);
  CHECK(messages.all().empty());
  const sap_test::Variable asked_for("ODE_PARALLEL_SAP_BACKEND", "cuda");
  const sap_test::Space space;
  REQUIRE(messages.all().size() == 1);
  CHECK(contains(messages.all()[0], "=cuda is not to be had (" + why + ") and is ignored"));
}

TEST_CASE("Full devices are tried and named once, and the others serve every frame",
          "[.][full-free][free-full-free][full-full]") {
  const sap_test::Messages messages;
  const int free = freeDevices();
  for (const int method : {dParallelSAPMethodSweep, dParallelSAPMethodAxisLists})
    for (int wanted = 1; wanted <= 3; ++wanted) {
      // Where none is free, CUDA is not to be had any more.
      if (free == 0 && !messages.all().empty()) continue;
      Scene scene(dParallelSAPBackendCUDA, wanted, 500, method);
      for (int frame = 0; frame < 6; ++frame) {
        const dParallelSAPStats stats = scene.collide();
        CHECK(stats.devices == std::min(wanted, free));
        CHECK(stats.backend == (free ? dParallelSAPBackendCUDA : dParallelSAPBackendCPU));
        CHECK(stats.method == method);
        CHECK((stats.pairs > 0) == (free == 0));
      }
    }
  checkFullOnes(messages);
  {
    Scene automatic(dParallelSAPBackendAuto, 3, 60000);
    if (free) CHECK(devicesThatAutoComesTo(automatic) == free);
    if (!free) CHECK(automatic.collide(30).devices == 0);
    if (!free) CHECK(dParallelSAPSpaceSetBackend(automatic.space, dParallelSAPBackendCUDA));
  }
  checkFullOnes(messages);
  checkAllGivenBack();
}

TEST_CASE("Auto uses the free device where the first is full, or says once that there is none",
          "[.][auto-full-free][auto-full]") {
  const sap_test::Messages messages;
  Scene scene(dParallelSAPBackendAuto, 0, 60000);
  dParallelSAPSpaceSetNumThreads(scene.space, 1);  // the fake devices are faster
  int devices = 0;
  for (int frame = 0; frame < 500 && (messages.all().empty() || devices < freeDevices()); ++frame)
    devices = scene.collide().devices;
  CHECK(devices == freeDevices());
  CHECK(scene.collide(20).devices == freeDevices());
  checkFullOnes(messages);
  // Nor is there one left where that fails.
  failCudaCall(freeDevices() ? 10 : 0);
  for (int frame = 0; frame < 30; ++frame) CHECK(scene.collide().devices == 0);
  failCudaCall(0);
  CHECK(messages.all().size() == 1u + freeDevices());
}

TEST_CASE("Only devices of one generation share a scene", "[.][free-other-free]") {
  const sap_test::Messages messages;
  {
    Scene scene(dParallelSAPBackendCUDA, 3);
    CHECK(scene.collide(3).devices == 2);
    CHECK(emulation::device(0).launches > 0);
    CHECK(emulation::device(1).launches == 0);
    CHECK(emulation::device(2).launches > 0);
    REQUIRE(messages.all().size() == 1);
    CHECK(contains(messages.all()[0], "GPU 1 cannot be used (another generation than GPU 0)"));
    Scene second(dParallelSAPBackendCUDA, 2);
    CHECK(second.collide(3).devices == 2);
    CHECK(messages.all().size() == 1);
    // Linked once for each space, whatever number of frames.
    for (const int device : {0, 2}) {
      CHECK(emulation::device(device).linked == 1);
      CHECK(emulation::device(device).asked_links == 2);
    }
  }
  checkAllGivenBack();
}

TEST_CASE("Devices that may not read each other's memory share no scene", "[.][no-links]") {
  const sap_test::Messages messages;
  using emulation::Settings;
  for (const auto links : {Settings::None, Settings::Refused}) {
    emulation::settings().links = links;
    Scene scene(dParallelSAPBackendCUDA, 2);
    CHECK(scene.collide(3).devices == 1);
    CHECK(emulation::device(0).asked_links == (links == Settings::Refused));
    CHECK(emulation::device(0).linked == 0);
    REQUIRE(messages.all().size() == 1u + (links == Settings::Refused));
    CHECK(contains(messages.all().back(), "GPU 1 failed (to read the memory of another GPU"));
    CHECK(contains(messages.all().back(), "GPUs left: 1"));
  }
}

TEST_CASE("Pages of large storage are locked from the second frame until it is given back",
          "[.][locks][locks-of-two]") {
  const int devices = freeDevices();
  REQUIRE(devices > 0);
  {
    // More for two devices, so that boxes are read in pieces.
    Scene scene(dParallelSAPBackendCUDA, devices, devices == 1 ? 20000 : 100000);
    scene.collide();
    CHECK(emulation::locks().asked == 0);  // it may be the only frame
    scene.collide();
    CHECK(emulation::locks().now > 0);
    const int asked = emulation::locks().asked;
    scene.collide(5);
    CHECK(emulation::locks().asked == asked);
    scene.world.addBoxes(sap_test::denseCube(devices * 60000, 6));  // which takes other storage
    scene.collide();
    CHECK(emulation::locks().now == 0);
    scene.collide();
    CHECK(emulation::locks().asked > asked);
    CHECK(emulation::locks().now > 0);
    Scene small(dParallelSAPBackendCUDA, 1, 2000);
    const std::size_t before = emulation::locks().now;
    small.collide(3);
    CHECK(emulation::locks().now == before);
  }
  CHECK(emulation::locks().now == 0);
  checkAllGivenBack();

  // Where pages cannot be locked frames are found as before.
  const sap_test::Messages messages;
  emulation::settings().locks_allowed = false;
  Scene scene(dParallelSAPBackendCUDA, 1, 20000);
  const int before = emulation::locks().asked;
  scene.collide(2);
  const int asked = emulation::locks().asked;
  CHECK(asked > before);
  CHECK(scene.collide(5).backend == dParallelSAPBackendCUDA);
  CHECK(emulation::locks().asked == asked);  // and nobody asks again
  CHECK(emulation::locks().now == 0);
  CHECK(messages.all().empty());
}

TEST_CASE("Kernels read boxes from locked pages, and write pairs to them", "[.][kernels-on-host]") {
  emulation::settings().kernels_run = true;
  Scene scene(dParallelSAPBackendCUDA, 1, 3000);
  CHECK(scene.collide(3).pairs > 8192);
  const std::size_t before = emulation::copiedBytes();
  scene.collide();
  CHECK(emulation::copiedBytes() - before < 1000);
}

TEST_CASE(
    "Devices read boxes while others are packed, and are waited for where they become doubles",
    "[.][read-ahead]") {
  emulation::settings().kernels_run = true;
  for (const int devices : {1, 2}) {
    INFO(devices << " devices");
    Scene scene(dParallelSAPBackendCUDA, devices, 500);
    const auto launches = [&] {
      const int before = emulation::device(0).launches;
      CHECK(scene.collide().devices == devices);
      return emulation::device(0).launches - before;
    };
    scene.collide(3);
    const int at_once = launches();
    const sap_test::ScopedGrain grain(1);
    CHECK(launches() > at_once);
    for (const double by : {1e8, -1e8}) {
      for (const dGeomID geom : scene.world.geoms()) {
        const dReal* const place = dGeomGetPosition(geom);
        dGeomSetPosition(geom, place[0] + by, place[1], place[2]);
      }
      for (int frame = 0; frame < 20; ++frame) {
        const sap_test::Pairs pairs = sap_test::collide(scene.space);
        REQUIRE(sap_test::difference(pairs, sap_test::expectedPairs(scene.world.geoms())) == "");
        REQUIRE(emulation::pending() == 0);
      }
      CHECK(statsOf(scene.space).devices == (by > 0 ? 0 : devices));
    }
    CHECK(launches() > at_once);
    // A frame that ends before it finds pairs, and one of other storage on the CPU.
    const dReal nan = std::numeric_limits<dReal>::quiet_NaN();
    dGeomSetPosition(scene.world.addBox({{0, 0, 0}, {1, 1, 1}}), nan, 0, 0);
    dMessageFunction* const before = dGetMessageHandler();
    dSetMessageHandler([](int, const char*, va_list) { throw std::runtime_error("left"); });
    CHECK_THROWS(sap_test::collide(scene.space));
    dSetMessageHandler(before);
    CHECK(emulation::pending() > 0);
    scene.world.addBoxes(sap_test::denseCube(500, 7));
    for (const int backend : {dParallelSAPBackendCPU, dParallelSAPBackendCUDA}) {
      REQUIRE(dParallelSAPSpaceSetBackend(scene.space, backend));
      CHECK(scene.collide().backend == backend);
      CHECK(emulation::pending() == 0);
    }
  }
}

TEST_CASE("After a fork the program's pages are locked anew", "[.][forked-locks]") {
  Scene scene(dParallelSAPBackendCUDA, 1, 20000);
  scene.collide(3);
  const emulation::Locks before = emulation::locks();
  REQUIRE(before.now > 0);
  // The pages that the child gives back are not those of the device.
  CHECK(isTrueInChild([&] {
    dSpaceDestroy(scene.space);
    return emulation::locks().now == before.now;
  }));
  scene.collide();
  CHECK(emulation::locks().asked == before.asked + static_cast<int>(before.now));
  CHECK(emulation::locks().now == before.now);
  scene.collide();
  CHECK(emulation::locks().asked == before.asked + static_cast<int>(before.now));
}

TEST_CASE("Devices are made ready once a thread for it can be had", "[.][no-thread]") {
  DevicePool& pool = DevicePool::get();
  {
    const sap_test::ThreadLimit limit(1);
    pool.prepare(2);
    CHECK(pool.ready() < 2);
  }
  CHECK(isMetWithin(20, [&] { return pool.prepare(2), pool.ready() == 2; }));
}

TEST_CASE("Full devices are tried again at growing intervals, until they have room", "[.][freed]") {
  const sap_test::Messages messages;
  Scene scene(dParallelSAPBackendCUDA, 2);
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(600)) scene.collide();
  CHECK(emulation::device(0).tried > 1);
  CHECK(emulation::device(0).tried < 8);
  CHECK(messages.all().size() == 3);  // one for each device
  emulation::setFull(1, false);
  CHECK(comesToDevices(scene, 1));
  emulation::setFull(0, false);
  CHECK(comesToDevices(scene, 2));
  CHECK(messages.all().size() == 3);
}

TEST_CASE("A device that is out of memory in a frame is used again, one that failed is not",
          "[.][full-in-frame]") {
  ode_parallel_sap::setMemoryRetry(std::chrono::milliseconds(20));
  for (const auto fail : {failAllocation, failCudaCall}) {
    Scene scene(dParallelSAPBackendCUDA, 1);
    const sap_test::Messages messages;
    fail(3);
    CHECK(scene.collide().devices == 0);
    CHECK(messages.all().size() == 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    CHECK(scene.collide(5).devices == (fail == failAllocation));
    CHECK(messages.all().size() == 1);
  }
}

TEST_CASE("Setting the CUDA back end has another thread make a device ready", "[.][first-use]") {
  Scene scene(dParallelSAPBackendCUDA);
  CHECK(isMetWithin(20, [] { return DevicePool::get().ready() == 1; }));
}

TEST_CASE("Frames go on where the program resets a device, which is made ready anew",
          "[.][reset]") {
  const sap_test::Messages messages;
  std::size_t said = 0;
  const auto play = [&](int backend, int method, std::size_t boxes) {
    emulation::settings().kernels_run = backend == dParallelSAPBackendCUDA;
    Scene scene(backend, 2, boxes, method);
    if (backend == dParallelSAPBackendAuto) dParallelSAPSpaceSetNumThreads(scene.space, 1);
    REQUIRE(comesToDevices(scene, 2));
    for (const int device : {1, 0, 0}) {
      INFO("method " << method << ", back end " << backend << ", device " << device);
      scene.collide(3);
      const emulation::Locks before = emulation::locks();
      emulation::reset(device);
      CHECK(scene.collide().devices == 0);
      REQUIRE(comesToDevices(scene, 2));
      scene.collide(3);
      // Auto may have gone back to the CPU meanwhile; lists that grew may be locked for the first
      // time.
      if (backend == dParallelSAPBackendCUDA) CHECK(emulation::locks().now >= before.now);
    }
    REQUIRE(messages.all().size() == ++said);
    CHECK(contains(messages.all().back(), "has reset a GPU"));
    emulation::reset(0);  // and then the space is destroyed
  };
  play(dParallelSAPBackendCUDA, dParallelSAPMethodSweep, 9000);
  CHECK(emulation::locks().now == 0);
  {
    const sap_test::ScopedGrain grain(1);  // devices read boxes while others are packed
    play(dParallelSAPBackendCUDA, dParallelSAPMethodSweep, 900);
  }
  play(dParallelSAPBackendCUDA, dParallelSAPMethodAxisLists, 2000);
  CHECK(emulation::locks().now == 0);
  play(dParallelSAPBackendAuto, dParallelSAPMethodSweep, 20000);
}

TEST_CASE("The child of a process that makes devices ready uses the CPU", "[.][forked]") {
  emulation::settings().contexts_wait = true;
  DevicePool::get().prepare(1);
  while (emulation::device(0).tried == 0) std::this_thread::yield();
  CHECK(isTrueInChild([] {
    Scene scene(dParallelSAPBackendCPU);
    const bool has_none = !dParallelSAPSpaceSetBackend(scene.space, dParallelSAPBackendCUDA);
    dParallelSAPSpaceSetBackend(scene.space, dParallelSAPBackendAuto);
    return has_none && scene.collide(30).devices == 0;
  }));
  emulation::settings().contexts_wait = false;
  Scene scene(dParallelSAPBackendCUDA);
  CHECK(scene.collide(3).devices == 1);
}

TEST_CASE("A program's device and context are left as they were", "[.][free-free]") {
  const auto frames = [](int devices) {
    const auto before = emulation::contextOfThread();
    {
      Scene scene(dParallelSAPBackendCUDA, devices);
      CHECK(scene.collide(3).devices == devices);
      Scene lists(dParallelSAPBackendCUDA, devices, 500, dParallelSAPMethodAxisLists);
      CHECK(lists.collide(3).devices == devices);
      CHECK(before == emulation::contextOfThread());
    }
    CHECK(before == emulation::contextOfThread());
  };
  // A thread that never had to do with CUDA gets no context, and no device that is not used does.
  frames(1);
  CHECK(emulation::contextOfThread().first == nullptr);
  CHECK(emulation::device(1).tried == 0);
  frames(2);
  CHECK(emulation::callsWithoutContext() == 0);
  // One with a context of its own, which is not the device's that the runtime uses.
  std::thread([&] {
    dAllocateODEDataForThread(dAllocateMaskAll);
    emulation::createContext(1);
    frames(1);
    frames(2);
  }).join();
  checkAllGivenBack();
}

TEST_CASE("A device that fails in a frame costs time, not pairs, and is given back whole",
          "[.][free-free-free]") {
  Scene(dParallelSAPBackendCUDA, 3).collide();  // makes all of them ready
  emulation::settings().kernels_run = true;
  const sap_test::Messages messages;
  const auto survives = [&](auto fail, unsigned long long number, int method, int devices) {
    Scene scene(dParallelSAPBackendCUDA, devices, 200, method);
    if (fail == failCudaCall && number % 2) scene.collide(3);
    const std::size_t told = messages.all().size();
    fail(number);
    const int used = scene.collide().devices;
    fail(0);
    if (messages.all().size() == told) return false;
    INFO(messages.all().back());
    // Another one takes its place, in the paper's method the processor.
    CHECK(used == (method == dParallelSAPMethodSweep ? std::min(devices, 2) : 0));
    CHECK(scene.collide(2).devices == used);
    CHECK(messages.all().size() == told + 1);
    return true;
  };
  for (const auto fail : {failCudaCall, failAllocation})
    for (const int method : {dParallelSAPMethodSweep, dParallelSAPMethodAxisLists})
      for (const int devices : {1, 2, 3}) {
        int met = 0;
        for (unsigned long long number = 1; number < 400; number += 1 + number / 8)
          met += survives(fail, number, method, devices);
        INFO(method << ", " << devices << " devices");
        CHECK(met >= 5);
      }
  {
    Scene scene(dParallelSAPBackendCUDA, 3, 200);
    for (int left = 2; left >= 0; --left) {
      failCudaCall(30);
      CHECK(scene.collide().devices == left);
    }
    failCudaCall(0);
  }
  checkAllGivenBack();
}

TEST_CASE("Of the threads that serve one device or several two and more have work",
          "[.][free-free-free]") {
  emulation::settings().kernels_run = true;
  const std::map<std::string, int> devices_of = {{"device: pairs of axis lists", 1},
                                                 {"device: axis lists", 3}};
  const sap_test::ScopedGrain grain(1);
  for (const auto& [region, devices] : devices_of)
    for (const int threads : {2, 3, 7, 16}) {
      INFO(region << ", " << threads << " threads");
      Scene scene(dParallelSAPBackendCUDA, devices, 500, dParallelSAPMethodAxisLists);
      dParallelSAPSpaceSetNumThreads(scene.space, threads);
      const auto shared = [name = region] { return sap_test::timesShared().at(name); };
      const std::uint64_t before = shared();
      for (int frame = 0; frame < 20 && shared() == before; ++frame)
        REQUIRE(scene.collide().devices == devices);
      CHECK(shared() > before);
    }
  for (const auto& [region, times] : sap_test::timesShared()) {
    INFO(region);
    CHECK(sap_test::isOfDevice(region) == (devices_of.count(region) == 1));
  }
}
