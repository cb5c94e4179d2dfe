#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <numeric>
#include <vector>

#include "cuda/axis_lists/cuda_axis_lists.h"
#include "cuda/check/check.h"
#include "cuda/check/scenes.h"
#include "cuda/device/fault_injection.h"
#include "space/pairs/sweep.h"
#include "space/paper/axis_lists.h"

namespace cuda_check {

using namespace ode_parallel_sap;

namespace {

std::vector<int> firstDevices(int count) {
  std::vector<int> devices(count);
  std::iota(devices.begin(), devices.end(), 0);
  return devices;
}

// One device, all, and one in three parts.
std::vector<std::vector<int>> deviceSets() {
  std::vector<std::vector<int>> sets = {{0}, {0, 0, 0}};
  for (int count = 2; count <= static_cast<int>(cudaDevices().size()); ++count)
    sets.push_back(firstDevices(count));
  return sets;
}

std::string nameOf(const std::vector<int>& devices) {
  std::string name = " on";
  for (const int device : devices) name += " " + std::to_string(device);
  return name;
}

void widen(BoxSet& boxes) {
  boxes.wide = boxes.exact = true;
  boxes.wide_boxes.resizeDiscarding(boxes.size);
  for (std::size_t i = 0; i < boxes.size; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      boxes.wide_boxes[i].lower[axis] = boxes.boxes[i].lower[axis];
      boxes.wide_boxes[i].upper[axis] = boxes.boxes[i].upper[axis];
    }
}

bool compareScene(const Scene& scene, const std::vector<int>& devices, std::size_t most,
                  CudaAxisLists& finder, int threads) {
  Sweep<float> cpu;
  Sweep<double> wide_cpu;
  BoxSet boxes;
  PairList expected, found;
  bool good = true;
  for (const std::size_t size : {0, 1, 2, 3, 33, 257, 1234, 5000, 20000}) {
    if (size > std::min(most, scene.most)) continue;
    for (const bool wide : {false, true}) {
      scene.fill(size, 5, boxes);
      if (wide) {
        widen(boxes);
        wide_cpu.find(boxes, threads, expected);
      } else {
        cpu.find(boxes, threads, expected);
      }
      finder.find(boxes, threads, found);
      good = samePairs(scene.name + ", " + std::to_string(size) + " boxes" + nameOf(devices) +
                           (wide ? ", doubles" : ""),
                       expected, found) &&
             good;
    }
  }
  return good;
}

bool checkFaultsAndLimit(const std::vector<int>& devices, int threads) {
  BoxSet boxes;
  PairList expected, found;
  sceneOf("filtered").fill(5000, 3, boxes);
  Sweep<float>().find(boxes, threads, expected);
  CudaAxisLists finder;
  finder.useDevices(devices);
  unsigned long long call = 1;
  for (bool failed = true; failed; ++call) {
    failed = false;
    failCudaCall(call);
    try {
      finder.find(boxes, threads, found);
    } catch (const DeviceFailure&) {
      failed = true;
    }
    failCudaCall(0);
  }
  bool good = samePairs("axis lists after faults", expected, found);
  std::printf("axis lists%s: %llu calls failed in turn\n", nameOf(devices).c_str(), call - 2);

  // A fresh scene, so that nothing of what is held suffices.
  sceneOf("cube").fill(10000, 3, boxes);
  Sweep<float>().find(boxes, threads, expected);
  most_list_bytes = 1 << 20;
  bool refused = false;
  try {
    finder.find(boxes, threads, found);
  } catch (const ListsTooLong& lists) {
    refused = lists.allowed == 1 << 20 && lists.needed > lists.allowed;
  }
  most_list_bytes = 0;
  finder.find(boxes, threads, found);
  good = samePairs("axis lists after their limit", expected, found) && good;
  if (!refused) std::printf("FAILED: the limit of the axis lists%s\n", nameOf(devices).c_str());
  return good && refused && call > 20;
}

template <class Work>
double medianMs(int repeats, Work work) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
            .count());
  }
  std::nth_element(times.begin(), times.begin() + repeats / 2, times.end());
  return times[repeats / 2];
}

}  // namespace

bool checkAxisLists(std::size_t most, int threads) {
  bool good = true;
  for (const std::vector<int>& devices : deviceSets()) {
    CudaAxisLists finder;
    finder.useDevices(devices);
    try {
      for (const Scene& scene : scenes())
        good = compareScene(scene, devices, most, finder, threads) && good;
      good = checkFaultsAndLimit(devices, threads) && good;
    } catch (const std::exception& failure) {
      std::printf("FAILED axis lists%s: %s\n", nameOf(devices).c_str(), failure.what());
      return false;
    }
    std::printf("axis lists%s: %s\n", nameOf(devices).c_str(), good ? "same" : "DIFFERENT");
  }
  return good;
}

void timeAxisLists(int threads) {
  std::printf(
      "axis lists of the dense cube, milliseconds host to host with %d threads\n"
      "   boxes     pairs devices   whole |  CPU 1 thread  CPU  | sweep on 1 device\n",
      threads);
  for (const std::size_t size : {260, 1000, 5000, 10000, 20000, 50000, 100000}) {
    const int repeats = size > 20000 ? 5 : 15;
    BoxSet boxes;
    PairList pairs;
    sceneOf("cube").fill(size, 11, boxes);
    AxisLists cpu;
    cpu.find(boxes, threads, pairs);
    const double cpu_one = medianMs(3, [&] { cpu.find(boxes, 1, pairs); });
    const double cpu_all = medianMs(3, [&] { cpu.find(boxes, threads, pairs); });
    CudaSweep sweep;
    sweep.find(boxes, threads, pairs);
    const double sweep_ms = medianMs(repeats, [&] { sweep.find(boxes, threads, pairs); });
    for (int devices = 1; devices <= static_cast<int>(cudaDevices().size()); devices *= 2) {
      CudaAxisLists finder;
      finder.useDevices(firstDevices(devices));
      finder.find(boxes, threads, pairs);
      const double ms = medianMs(repeats, [&] { finder.find(boxes, threads, pairs); });
      std::printf("%8zu %9zu %7d %7.3f | %9.2f %8.2f | %8.3f\n", size, pairs.size(), devices, ms,
                  cpu_one, cpu_all, sweep_ms);
      std::fflush(stdout);
    }
  }
}

}  // namespace cuda_check
