// What a real driver and GPU do; built into one program with the library's objects, so that it can
// make CUDA fail.
#include <cuda.h>
#include <cuda_runtime_api.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <thread>
#include <utility>

#include "cuda/device/fault_injection.h"
#include "cuda/finder/cuda_sweep.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/ode_errors.h"
#include "support/recorder.h"
#include "support/scenes.h"

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

}  // namespace

// The same on emulated devices is in device_subset_test.cpp; here the driver has the word.
TEST_CASE("Frames leave a thread's device and context to the program", "[device][several]") {
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
