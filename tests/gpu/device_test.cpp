// What a real driver says; built into one program with the library's objects, and so with its CUDA
// runtime.
#include <cuda.h>
#include <cuda_runtime_api.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <thread>
#include <utility>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/recorder.h"
#include "support/scenes.h"

// The same on emulated devices is in device_subset_test.cpp; here the driver has the word.
TEST_CASE("Frames leave a thread's device and context to the program", "[device]") {
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
      const sap_test::Space space;
      sap_test::World world(space);
      REQUIRE(dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCUDA));
      REQUIRE(dParallelSAPSpaceSetMethod(space, dParallelSAPMethodSweep));
      dParallelSAPSpaceSetNumDevices(space, devices);
      world.addBoxes(sap_test::denseCube(3000, 5));
      for (int frame = 0; frame < 3; ++frame) sap_test::collide(space);
      if (statsOf(space).devices != devices || current() != before) return true;
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
