#include <cuda_runtime_api.h>

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>

#include "cuda/check/check.h"
#include "cuda/check/scenes.h"
#include "cuda/device/fault_injection.h"
#include "space/pairs/sweep.h"

namespace cuda_check {

using namespace ode_parallel_sap;

// On several devices the frame is finished by those that are left; a finder whose last device fails
// says so and is replaced.
bool checkFaults(int threads, int devices, bool measuring) {
  BoxSet boxes;
  sceneOf("filtered").fill(30000, 3, boxes);
  Sweep<float> cpu;
  PairList expected, found;
  cpu.find(boxes, threads, expected);
  bool good = true;
  unsigned long long call = 1;
  // Several devices make thousands of calls, the more the longer they wait: some must do, the later
  // the fewer.
  int met = 0;
  for (bool failed = true; failed; call += devices > 1 ? 1 + call / 12 : 1) {
    CudaSweep finder(devicesFor(devices));
    finder.useDevices(devices);
    finder.measure(measuring);
    std::string reason;
    failCudaCall(call);
    try {
      finder.find(boxes, threads, found);
      for (const FailedDevice& failed_device : finder.takeFailures()) reason = failed_device.reason;
      good = samePairs("a device failed", expected, found) && good;
      good = good && finder.devicesLost() == !reason.empty();
    } catch (const DeviceFailure& failure) {
      reason = failure.what();
      good = good && devices == 1;
    }
    failCudaCall(0);
    failed = !reason.empty();
    if (failed && met++ % 40 == 0) std::printf("call %llu: %s\n", call, reason.c_str());
    std::fflush(stdout);
  }
  CudaSweep finder(devicesFor(devices));
  finder.useDevices(devices);
  finder.find(boxes, threads, found);
  std::printf("faults on %d devices%s: %d of %llu calls in turn: %s\n", devices,
              measuring ? ", measured" : "", met, call - 1, good ? "good" : "BAD");
  std::fflush(stdout);
  return samePairs("after faults", expected, found) && good && met > 40;
}

bool checkSharing(int threads) {
  bool good[2] = {true, true};
  std::thread users[2];
  for (int user = 0; user < 2; ++user)
    users[user] = std::thread([&, user] {
      Sweep<float> cpu;
      BoxSet boxes;
      PairList expected, found;
      CudaSweep device;
      for (int frame = 0; frame < 20; ++frame) {
        sceneOf(frame % 2 ? "bars" : "cube").fill(5000 + 1000 * frame, frame + 100 * user, boxes);
        cpu.find(boxes, 2, expected);
        device.find(boxes, 2, found);
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
    CudaSweep().find(boxes, threads, found);
  }
  cudaMemGetInfo(&after, &all);
  std::printf("sharing: two at once %s; 200 finders: %zu bytes less free\n",
              good[0] && good[1] ? "same" : "DIFFERENT", before > after ? before - after : 0);
  return good[0] && good[1] && after + (4 << 20) >= before;
}

bool checkLocks(int threads) {
  using Clock = std::chrono::steady_clock;
  Sweep<float> cpu;
  PairList expected;
  CudaSweep device;
  bool good = true;
  double longest = 0;
  const auto frames = [&](BoxSet& boxes, PairList& found, int count, std::uint64_t seed) {
    for (int frame = 0; frame < count; ++frame) {
      sceneOf("cube").fill(200000, seed + frame, boxes);
      cpu.find(boxes, threads, expected);
      const Clock::time_point begin = Clock::now();
      device.find(boxes, frame % 2 ? threads : 1, found);
      const double ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
      if (seed > 1 && ms > longest) longest = ms;
      good = samePairs("locked storage", expected, found) && good;
    }
  };
  for (int round = 0; round < 3; ++round) {  // storage at the same places as before
    BoxSet boxes;
    PairList found;
    frames(boxes, found, 4, 1 + 10 * round);
    // A child has the pages that are locked until either writes to them.
    const pid_t child = fork();
    if (child == 0) {
      for (;;) pause();
    }
    frames(boxes, found, 4, 100 + 10 * round);
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    frames(boxes, found, 2, 200 + 10 * round);
  }
  std::printf("locked storage: %s; the longest frame took %.1f ms\n", good ? "same" : "DIFFERENT",
              longest);
  std::fflush(stdout);
  return good;
}

}  // namespace cuda_check
