#include <cuda_runtime_api.h>

#include <cstdio>
#include <thread>

#include "../../space/sweep.h"
#include "../fault_injection.h"
#include "check.h"
#include "scenes.h"

namespace cuda_check {

using namespace ode_parallel_sap;

// On several devices the frame is finished by those that are left; a finder whose last device fails
// says so and is replaced.
bool checkFaults(int threads, int devices) {
  BoxSet boxes;
  sceneOf("filtered").fill(30000, 3, boxes);
  Sweep<float> cpu;
  PairList expected, found;
  cpu.find(boxes, threads, expected);
  bool good = true;
  unsigned long long call = 1;
  // Several devices have so many calls that some must do.
  for (bool failed = true; failed; call += devices > 1 ? 7 : 1) {
    const std::unique_ptr<CudaPairFinder> finder = makeCudaSweep(devicesFor(devices));
    finder->useDevices(devices);
    failed = false;
    failCudaCall(call);
    try {
      finder->find(boxes, threads, found);
      failed = !finder->failures().empty();
      good = samePairs("a device failed", expected, found) && good;
      good = good && finder->devicesLeft() == devices - failed;
    } catch (const DeviceFailure& failure) {
      failed = true;
      good = good && devices == 1;
      if (call % 40 == 1) std::printf("call %llu: %s\n", call, failure.what());
    }
    failCudaCall(0);
  }
  const std::unique_ptr<CudaPairFinder> finder = makeCudaSweep(devicesFor(devices));
  finder->useDevices(devices);
  finder->find(boxes, threads, found);
  std::printf("faults on %d devices: %llu calls in turn: %s\n", devices, call - 1,
              good ? "good" : "BAD");
  std::fflush(stdout);
  return samePairs("after faults", expected, found) && good && call > 40;
}

bool checkSharing(int threads) {
  bool good[2] = {true, true};
  std::thread users[2];
  for (int user = 0; user < 2; ++user)
    users[user] = std::thread([&, user] {
      Sweep<float> cpu;
      BoxSet boxes;
      PairList expected, found;
      const std::unique_ptr<CudaPairFinder> device = makeCudaSweep();
      for (int frame = 0; frame < 20; ++frame) {
        sceneOf(frame % 2 ? "bars" : "cube").fill(5000 + 1000 * frame, frame + 100 * user, boxes);
        cpu.find(boxes, 2, expected);
        device->find(boxes, 2, found);
        good[user] = samePairs("two at once", expected, found) && good[user];
      }
    });
  for (std::thread& user : users) user.join();

  BoxSet boxes;
  PairList found;
  sceneOf("cube").fill(20000, 1, boxes);
  std::size_t before = 0, after = 0, all = 0;
  for (int round = 0; round < 200; ++round) {
    if (round == 5) cudaMemGetInfo(&before, &all);
    makeCudaSweep()->find(boxes, threads, found);
  }
  cudaMemGetInfo(&after, &all);
  std::printf("sharing: two at once %s; 200 finders: %zu bytes less free\n",
              good[0] && good[1] ? "same" : "DIFFERENT", before > after ? before - after : 0);
  return good[0] && good[1] && after + (4 << 20) >= before;
}

}  // namespace cuda_check
