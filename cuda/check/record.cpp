#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "../../space/backend_choice.h"
#include "../../space/brute_force.h"
#include "../../space/sweep.h"
#include "../../tests/bench/csv.h"
#include "check.h"
#include "scenes.h"

namespace cuda_check {

using namespace ode_parallel_sap;
using bench::median;

namespace {

using Clock = std::chrono::steady_clock;

// Finds the pairs of a scene on any number of devices or, on 0, as a space on the processor does.
class Finders {
 public:
  Finders(int threads, int devices) : threads_(threads) {
    for (int used = 1; used <= devices; used *= 2) {
      finders_[used] = makeCudaSweep(devicesFor(used));
      finders_[used]->useDevices(used);
    }
  }
  // Milliseconds.
  double find(int devices, const BoxSet& boxes, PairList& pairs) {
    const Clock::time_point begin = Clock::now();
    if (devices > 0)
      finders_.at(devices)->find(boxes, threadsFor(boxes.size), pairs);
    else if (boxes.size <= 700)  // the limits of ParallelSAPSpace
      brute_force_.find(boxes, 1, pairs);
    else
      sweep_.find(boxes, threadsFor(boxes.size), pairs);
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  }
  CudaPairFinder& on(int devices) { return *finders_.at(devices); }

 private:
  int threadsFor(std::size_t boxes) const {
    if (boxes < 4096) return 1;
    return static_cast<int>(std::min<std::size_t>(threads_, boxes / 1024));
  }

  const int threads_;
  BruteForce<float> brute_force_;
  Sweep<float> sweep_;
  std::map<int, std::unique_ptr<CudaPairFinder>> finders_;
};

// One line of the file: times of a scene in one way. Kernel times are those of one device.
bench::Row rowOf(const std::string& scene, std::size_t boxes, const std::string& on, int threads,
                 const std::vector<double>& times, std::size_t pairs) {
  const double least = times.empty() ? std::nan("") : *std::min_element(times.begin(), times.end());
  bench::Row row;
  row.add("scene", scene)
      .add("n", boxes)
      .add("on", on)
      .add("threads", threads)
      .add("samples", times.size())
      .add("median_ms", median(times))
      .add("min_ms", least)
      .add("pairs", pairs)
      .add("floor_ms",
           (24.0 * static_cast<double>(boxes) + 8.0 * static_cast<double>(pairs)) / 55e6);
  return row;
}

void addStages(bench::Row& row, const std::vector<CudaStageTimes>& all) {
  const auto stage = [&](float CudaStageTimes::*member) {
    std::vector<double> values;
    for (const CudaStageTimes& times : all) values.push_back(times.*member);
    return median(values);
  };
  std::vector<double> device;
  for (const CudaStageTimes& times : all) device.push_back(times.device());
  row.add("upload_ms", stage(&CudaStageTimes::upload))
      .add("classify_ms", stage(&CudaStageTimes::classify))
      .add("sort_ms", stage(&CudaStageTimes::sort))
      .add("cells_ms", stage(&CudaStageTimes::cells))
      .add("search_ms", stage(&CudaStageTimes::search))
      .add("scan_ms", stage(&CudaStageTimes::scan))
      .add("scatter_ms", stage(&CudaStageTimes::scatter))
      .add("lists_ms", stage(&CudaStageTimes::lists))
      .add("device_ms", median(device))
      .add("host_wait_ms", stage(&CudaStageTimes::host_wait))
      .add("host_pairs_ms", stage(&CudaStageTimes::host_pairs));
}

// What the back end Auto does once its devices are ready.
std::vector<double> timesOfChoice(Finders& finders, const BoxSet& boxes, int devices,
                                  double budget_ms, int& last, PairList& pairs) {
  BackendChoice choice;
  const auto candidates = BackendChoice::Candidates::upTo(true, devices);
  const auto frame = [&] {
    last = choice.choose(boxes.size, candidates);
    const double ms = finders.find(last, boxes, pairs);
    choice.learn(last, boxes.size, pairs.size(), ms);
    return ms;
  };
  for (int i = 0; i < 30; ++i) frame();
  std::vector<double> times;
  for (double ms = 0; times.size() < 5 || (ms < budget_ms && times.size() < 500);) {
    times.push_back(frame());
    ms += times.back();
  }
  return times;
}

// The frames of all ways but Auto in turn, so that a disturbance meets all.
void recordScene(const Scene& scene, std::size_t size, int threads, const std::vector<int>& ways,
                 bool with_choice, double budget_ms, Finders& finders, bench::Csv& csv) {
  BoxSet boxes;
  PairList pairs;
  scene.fill(size, 11, boxes);
  std::map<int, std::vector<double>> times;
  // Storage comes into being, and where all ways share it, in turn.
  for (const int way : ways)
    for (int i = 0; i < (way > 0 ? 5 : 2); ++i) finders.find(way, boxes, pairs);
  for (int i = 0; i < 2; ++i)
    for (const int way : ways) finders.find(way, boxes, pairs);
  double slowest = 0;
  for (double ms = 0; times[ways[0]].size() < 5 || ms < budget_ms;) {
    for (const int way : ways) {
      times[way].push_back(finders.find(way, boxes, pairs));
      slowest = std::max(slowest, times[way].back());
      ms += times[way].back();
    }
    if (times[ways[0]].size() >= 200) break;
  }
  const std::size_t count = pairs.size();
  for (const int way : ways) {
    bench::Row row = rowOf(scene.name, size, std::to_string(way), threads, times[way], count);
    std::vector<CudaStageTimes> stages;
    if (way == 1) {
      finders.on(1).measure(true);
      for (int i = 0; i < 9; ++i) {
        finders.find(1, boxes, pairs);
        stages.push_back(finders.on(1).times());
      }
      finders.on(1).measure(false);
    } else if (way > 1) {
      for (int i = 0; i < 5; ++i) {
        finders.find(way, boxes, pairs);
        stages.push_back(finders.on(way).times());
        stages.back() = CudaStageTimes();
        stages.back().host_wait = finders.on(way).times().host_wait;
        stages.back().host_pairs = finders.on(way).times().host_pairs;
      }
    }
    addStages(row, stages);
    csv.write(row.add("chosen", way).addMachine());
  }
  if (with_choice) {
    int chosen = 0;
    const std::vector<double> taken =
        timesOfChoice(finders, boxes, ways.back(), budget_ms / 2, chosen, pairs);
    bench::Row row = rowOf(scene.name, size, "auto", threads, taken, count);
    addStages(row, {});
    csv.write(row.add("chosen", chosen).addMachine());
  }
  std::fprintf(stderr, "%s %zu\n", scene.name.c_str(), size);
}

}  // namespace

bool recordTimes(const std::string& path, std::size_t most, int threads, int devices) {
  bench::Csv csv(path, false);
  std::vector<int> ways = {0};
  for (int used = 1; used <= devices; used *= 2) ways.push_back(used);
  {
    Finders finders(threads, devices);
    for (const std::size_t size :
         {2,       10,      30,      100,     300,      1000,     2000,
          4000,    10000,   20000,   50000,   100000,   200000,   500000,
          1000000, 2000000, 4000000, 8000000, 16000000, 32000000, 64000000})
      if (size <= most)
        recordScene(sceneOf("cube"), size, threads, ways, true, size > 500000 ? 500 : 150, finders,
                    csv);
  }
  Finders finders(threads, 1);
  for (const Scene& scene : scenes())
    if (scene.name != "cube" && most >= 1000000)
      recordScene(scene, std::min<std::size_t>(scene.most, 1000000), threads, {0, 1}, false, 300,
                  finders, csv);
  return true;
}

}  // namespace cuda_check
