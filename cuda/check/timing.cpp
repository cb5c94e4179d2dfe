#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "cuda/check/check.h"
#include "cuda/check/motion.h"
#include "cuda/check/scenes.h"
#include "space/pairs/sweep.h"

namespace cuda_check {

using namespace ode_parallel_sap;

namespace {

using Clock = std::chrono::steady_clock;

double medianOf(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

template <class Work>
std::vector<double> timesOf(int repeats, Work work) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const Clock::time_point begin = Clock::now();
    work();
    times.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
  }
  return times;
}

void printStages(CudaSweep& finder, const BoxSet& boxes, int threads, int repeats) {
  PairList pairs;
  finder.measure(true);
  std::vector<double> stages[11];
  for (int i = 0; i < repeats; ++i) {
    finder.find(boxes, threads, pairs);
    const CudaStageTimes& t = finder.times();
    const double all[11] = {t.upload,  t.classify, t.sort,     t.cells,     t.search,    t.scan,
                            t.scatter, t.lists,    t.device(), t.host_wait, t.host_pairs};
    for (int stage = 0; stage < 11; ++stage) stages[stage].push_back(all[stage]);
  }
  finder.measure(false);
  for (const std::vector<double>& stage : stages) std::printf("%6.3f ", medianOf(stage));
}

void timeScene(const Scene& scene, std::size_t size, int threads) {
  constexpr int warm_up = 4;  // fixed: how times are taken
  const int repeats = size > 2000000 ? 15 : 31;
  BoxSet boxes;
  PairList pairs, expected;
  scene.fill(size, 11, boxes);
  CudaSweep device;
  Sweep<float> cpu;
  for (int i = 0; i < warm_up; ++i) device.find(boxes, threads, pairs);
  const std::vector<double> times = timesOf(repeats, [&] { device.find(boxes, threads, pairs); });

  cpu.find(boxes, threads, expected);
  const double cpu_ms =
      medianOf(timesOf(size > 2000000 ? 2 : 4, [&] { cpu.find(boxes, threads, expected); }));
  const double best = *std::min_element(times.begin(), times.end());
  const double median = medianOf(times);
  std::printf("%-9s %8zu %9zu%s %7.3f %7.3f %6.3f | ", scene.name.c_str(), size, pairs.size(),
              pairs.size() == expected.size() ? " " : "!", median, best,
              1e6 * median / static_cast<double>(std::max<std::size_t>(1, pairs.size())));
  printStages(device, boxes, threads, repeats);
  std::printf("| %8.2f %5.1f %6.0f\n", cpu_ms, cpu_ms / median, device.deviceBytes() / 1048576.0);
  std::fflush(stdout);
}

void timeDevice(const BoxSet& boxes, int threads, int devices, const Scene& scene) {
  const int repeats = boxes.size > 2000000 ? 11 : 31;
  CudaSweep finder(devicesFor(devices));
  finder.useDevices(devices);
  PairList pairs;
  for (int i = 0; i < 6; ++i) finder.find(boxes, threads, pairs);
  const std::vector<double> times = timesOf(repeats, [&] { finder.find(boxes, threads, pairs); });
  std::printf("%-9s %9zu %d %10zu %8.3f %8.3f | ", scene.name.c_str(), boxes.size, devices,
              pairs.size(), medianOf(times), *std::min_element(times.begin(), times.end()));
  printStages(finder, boxes, threads, repeats);
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

bool timeDevices(std::size_t most, int threads, int devices) {
  std::printf(
      "scene         boxes devices  pairs   median     best |  upld  class   sort  cells search  "
      " scan  scatt  lists device   wait  write, ms\n");
  for (std::size_t size = 250000; size <= most; size *= 4) {
    BoxSet boxes;
    const Scene& scene = sceneOf("cube");
    scene.fill(size, 11, boxes);
    for (int used = 1; used <= devices; used *= 2) timeDevice(boxes, threads, used, scene);
  }
  return true;
}

void profile(const std::string& scene, std::size_t size, int threads) {
  BoxSet boxes;
  PairList pairs;
  sceneOf(scene).fill(size, 11, boxes);
  CudaSweep device;
  Motion motion(boxes);
  for (int frame = 0; frame < 8; ++frame) {
    motion.advance();
    device.find(boxes, threads, pairs);
  }
}

bool timeAll(bool quick, int threads) {
  std::printf(
      "milliseconds, host to host with %d threads; then the device's stages, their sum from the "
      "last box's arrival on, and the host's waiting and writing\n",
      threads);
  std::printf(
      "scene        boxes     pairs   median    best ns/pair |  upld  class   sort  cells search  "
      " scan  scatt  lists device   wait  write |      CPU   x    MiB\n");
  for (const std::size_t size : {1000, 10000, 100000, 1000000, 4000000})
    timeScene(sceneOf("cube"), size, threads);
  if (quick) return true;
  for (const Scene& scene : scenes())
    if (scene.name != "cube") timeScene(scene, std::min<std::size_t>(scene.most, 1000000), threads);
  return true;
}

}  // namespace cuda_check
