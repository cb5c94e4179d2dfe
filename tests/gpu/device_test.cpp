// What becomes of frames when the GPU is not there, fails or runs out of memory; built into one
// program with the library's objects, so that it can make CUDA fail.
#include <cuda.h>
#include <cuda_runtime_api.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "cuda/device/fault_injection.h"
#include "cuda/finder/cuda_sweep.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/teams.h"

using namespace ode_parallel_sap;
using sap_test::Boxes;
using sap_test::difference;
using sap_test::Pairs;

namespace {

// A scene in a space of its own.
struct Scene {
  sap_test::Space space;
  sap_test::World world{space};

  Scene(const Boxes& boxes, int backend, int devices = 0) {
    REQUIRE(dParallelSAPSpaceSetBackend(space, backend));
    REQUIRE(dParallelSAPSpaceSetMethod(space, dParallelSAPMethodSweep));
    dParallelSAPSpaceSetNumDevices(space, devices);
    world.addBoxes(boxes);
  }
  Pairs collide() { return sap_test::collide(space); }
  dParallelSAPStats stats() const { return statsOf(space); }
};

Pairs pairsOnProcessor(const Boxes& boxes) {
  return Scene(boxes, dParallelSAPBackendCPU).collide();
}

// Devices of this process, by the variable that CMakeLists.txt sets.
int available() {
  const char* const text = std::getenv("ODE_PARALLEL_SAP_VIRTUAL_DEVICES");
  REQUIRE(text);
  return std::atoi(text);
}

// What fails while a device is made ready leaves it out for the rest of the program; these tests
// are of what fails later.
void makeDevicesReady() {
  Scene scene(sap_test::denseCube(1000, 1), dParallelSAPBackendCUDA, available());
  scene.collide();
  REQUIRE(scene.stats().devices == available());
}

// One frame during which a fault is met, and one after it. Returns whether the fault was met at
// all.
bool survives(const Boxes& boxes, const Pairs& expected, int devices, int frames_before,
              void (*inject)(unsigned long long), unsigned long long number) {
  Scene scene(boxes, dParallelSAPBackendCUDA, devices);
  for (int frame = 0; frame < frames_before; ++frame) scene.collide();
  const sap_test::Messages messages;
  inject(number);
  const Pairs during = scene.collide();
  inject(0);
  const dParallelSAPStats met = scene.stats();
  if (messages.all().empty()) {
    CHECK(met.devices == devices);
    return false;
  }
  INFO(number << ": " << messages.all().front());
  CHECK(difference(during, expected) == "");
  const int left = std::min(devices, available() - 1);
  CHECK(met.devices == left);
  CHECK(met.backend == (left > 0 ? dParallelSAPBackendCUDA : dParallelSAPBackendCPU));
  // Not tried again, and not mentioned again.
  CHECK(difference(scene.collide(), expected) == "");
  CHECK(scene.stats().devices == left);
  CHECK(messages.all().size() == 1);
  return true;
}

void surviveAll(int devices, int frames_before, void (*inject)(unsigned long long),
                std::size_t stride, int least) {
  makeDevicesReady();
  const Boxes boxes = sap_test::denseCube(3000, 5);
  const Pairs expected = pairsOnProcessor(boxes);
  sap_test::Random random(sap_test::seedOr(21));
  int met = 0;
  unsigned long long number = 1;
  while (survives(boxes, expected, devices, frames_before, inject, number)) {
    ++met;
    number += met < 8 ? 1 : 1 + random.below(stride);
  }
  CHECK(met >= least);
}

// ODE_PARALLEL_SAP_TEST_MACHINE, read before anything can ask the driver.
const char* const machine = [] {
  const char* const text = std::getenv("ODE_PARALLEL_SAP_TEST_MACHINE");
  const std::string name = text ? text : "";
  if (name == "no-driver") pretendMachine(PretendedMachine::NoDriver);
  if (name == "no-device") pretendMachine(PretendedMachine::NoDevice);
  if (name == "old-device") pretendMachine(PretendedMachine::TooOld);
  return text;
}();

}  // namespace

// Each kind of machine has a process of its own, as the driver is asked once.
TEST_CASE("On a machine without a device that will do frames stay on the CPU", "[.][machine]") {
  REQUIRE(machine);
  const std::string name = machine;
  std::string why;
  CHECK(cudaDevices(&why).empty());
  INFO(why);
  CHECK(why.find(name == "no-driver"   ? "driver version"
                 : name == "no-device" ? "no CUDA-capable device"
                                       : "too old: compute capability 5.2") != std::string::npos);
  const Boxes boxes = sap_test::denseCube(20000, 6);
  const Pairs expected = pairsOnProcessor(boxes);
  const sap_test::Messages messages;
  Scene scene(boxes, dParallelSAPBackendAuto);
  CHECK(dParallelSAPSpaceSetBackend(scene.space, dParallelSAPBackendCUDA) == 0);
  // Long enough for Auto to look for a device.
  for (int frame = 0; frame < 30; ++frame) {
    const Pairs found = scene.collide();
    if (found != expected) FAIL(difference(found, expected));
  }
  CHECK(scene.stats().backend == dParallelSAPBackendCPU);
  CHECK(messages.all().empty());
}

TEST_CASE("A call that fails costs time, not pairs", "[device][one]") {
  REQUIRE(available() == 1);
  surviveAll(1, 0, failCudaCall, 6, 15);
  surviveAll(1, 3, failCudaCall, 3, 8);
}

TEST_CASE("Memory that ends on the device costs time, not pairs", "[device][one]") {
  surviveAll(1, 0, failCudaAllocation, 4, 8);
}

TEST_CASE("One device of several that fails leaves the frame to the others", "[device][several]") {
  REQUIRE(available() == 3);
  surviveAll(2, 0, failCudaCall, 12, 10);
  surviveAll(3, 2, failCudaCall, 12, 8);
  surviveAll(2, 0, failCudaAllocation, 8, 8);
}

TEST_CASE("When all devices fail the frame is the CPU's", "[device][several]") {
  REQUIRE(available() == 3);
  makeDevicesReady();
  const Boxes boxes = sap_test::denseCube(3000, 5);
  const Pairs expected = pairsOnProcessor(boxes);
  Scene scene(boxes, dParallelSAPBackendCUDA, 3);
  const sap_test::Messages messages;
  for (int left = 2; left >= 0; --left) {
    failCudaCall(30);
    CHECK(difference(scene.collide(), expected) == "");
    CHECK(scene.stats().devices == left);
  }
  failCudaCall(0);
  CHECK(messages.all().size() == 3);
}

TEST_CASE("Pairs for which there was no room are found all the same", "[device][several]") {
  // Thirteen pairs a box, where eight are reckoned with at first; then few, then many again.
  for (const int devices : {1, 2}) {
    Scene scene(sap_test::touchingLattice(20000, 7), dParallelSAPBackendCUDA, devices);
    const Pairs expected = pairsOnProcessor(sap_test::touchingLattice(20000, 7));
    CHECK(difference(scene.collide(), expected) == "");
    CHECK(scene.stats().devices == devices);
    CHECK(difference(scene.collide(), expected) == "");
  }
}

// The same on emulated devices is in device_subset_test.cpp; here the driver has the word.
TEST_CASE("Frames leave a thread's device and context to the program", "[device][several]") {
  makeDevicesReady();
  void* found = nullptr;
#if CUDART_VERSION >= 12050
  cudaGetDriverEntryPointByVersion("cuCtxGetCurrent", &found, 12000, cudaEnableDefault);
#else
  cudaGetDriverEntryPoint("cuCtxGetCurrent", &found, cudaEnableDefault);
#endif
  REQUIRE(found);
  const auto current = [found] {
    CUcontext context = nullptr;
    int device = -1;
    reinterpret_cast<decltype(&cuCtxGetCurrent)>(found)(&context);
    cudaGetDevice(&device);
    return std::make_pair(context, device);
  };
  const auto framesChange = [&] {
    const auto before = current();
    for (const int devices : {1, 2, 3}) {
      Scene scene(sap_test::denseCube(3000, 5), dParallelSAPBackendCUDA, devices);
      for (int frame = 0; frame < 3; ++frame) scene.collide();
      if (scene.stats().devices != devices || current() != before) return true;
    }
    return current() != before;
  };
  int last = -1;
  REQUIRE(cudaGetDeviceCount(&last) == cudaSuccess);
  --last;
  bool changed_nothing = true, changed_context = true;
  std::thread([&] {
    dAllocateODEDataForThread(dAllocateMaskAll);
    changed_nothing = current().first != nullptr || framesChange();
    cudaSetDevice(last);
    changed_context = current().first == nullptr || current().second != last || framesChange();
  }).join();
  CHECK_FALSE(changed_nothing);
  CHECK_FALSE(changed_context);
}

TEST_CASE("Auto moves to a device that pays, and back from one that fails", "[device][one]") {
  // All geoms move, so that each frame has to find its pairs anew.
  const Boxes boxes = sap_test::denseCube(60000, 8);
  Scene scene(boxes, dParallelSAPBackendAuto), twin(boxes, dParallelSAPBackendCPU);
  std::uint64_t frame = 0;
  const auto collideNext = [&] {
    ++frame;
    scene.world.jitter(0.1, frame);
    twin.world.jitter(0.1, frame);
    const Pairs found = scene.collide(), expected = twin.collide();
    if (found != expected) FAIL(difference(found, expected));
  };
  dParallelSAPSpaceSetNumThreads(scene.space, 1);  // any device is faster than that
  while (frame < 500 && scene.stats().devices == 0) collideNext();
  INFO(frame << " frames");
  CHECK(scene.stats().backend == dParallelSAPBackendCUDA);
  const sap_test::Messages messages;
  for (int i = 0; i < 10; ++i) collideNext();
  CHECK(messages.all().empty());
  failCudaCall(10);
  collideNext();
  failCudaCall(0);
  CHECK(scene.stats().backend == dParallelSAPBackendCPU);
  for (int i = 0; i < 30; ++i) collideNext();
  CHECK(scene.stats().backend == dParallelSAPBackendCPU);
  CHECK(messages.all().size() == 1);
}

TEST_CASE("Spaces that come and go leave nothing on the device", "[device][several]") {
  const Boxes boxes = sap_test::denseCube(2000, 9);
  const auto round = [&](int devices) { Scene(boxes, dParallelSAPBackendCUDA, devices).collide(); };
  for (int i = 0; i < 5; ++i) round(2);
  const std::size_t before = freeDeviceMemory();
  for (int i = 0; i < 200; ++i) round(1 + i % 2);
  const std::size_t after = freeDeviceMemory();
  INFO(before << " bytes free before, " << after << " after");
  CHECK(after + (4 << 20) >= before);
}

namespace {

const std::vector<std::string> regions_of_one = {"device: pairs of axis lists"};
const std::vector<std::string> regions_of_several = {"device: axis lists"};

// Plays frames by each method until two threads have had work in all the regions.
void shareRegions(int devices, const std::vector<std::string>& regions) {
  const Boxes boxes = sap_test::denseCube(60000, 11);
  const Pairs expected = pairsOnProcessor(boxes);
  const sap_test::ScopedGrain grain(1);
  for (const int threads : {2, 3, 7, 16}) {
    Scene scene(boxes, dParallelSAPBackendCUDA, devices);
    dParallelSAPSpaceSetNumThreads(scene.space, threads);
    const auto before = sap_test::timesShared();
    const auto left = [&] {
      std::string left;
      const auto after = sap_test::timesShared();
      for (const std::string& region : regions)
        if (after.at(region) == before.at(region)) left += region + "; ";
      return left;
    };
    for (int frame = 0; frame < 20 && !left().empty(); ++frame) {
      INFO(threads << " threads, frame " << frame);
      REQUIRE(dParallelSAPSpaceSetMethod(scene.space, dParallelSAPMethodAxisLists));
      REQUIRE(difference(scene.collide(), expected) == "");
      REQUIRE(scene.stats().devices == devices);
    }
    INFO(threads << " threads");
    CHECK(left() == "");
  }
}

}  // namespace

TEST_CASE("Of the threads that serve a device two and more have work", "[device][one]") {
  shareRegions(1, regions_of_one);
  for (const auto& [region, times] : sap_test::timesShared()) {
    INFO(region);
    const bool covered = std::count(regions_of_one.begin(), regions_of_one.end(), region) +
                         std::count(regions_of_several.begin(), regions_of_several.end(), region);
    CHECK(covered == sap_test::isOfDevice(region));
  }
}

TEST_CASE("Of the threads that serve several devices two and more have work", "[device][several]") {
  shareRegions(3, regions_of_several);
}
