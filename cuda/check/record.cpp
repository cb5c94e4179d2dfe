#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "cuda/check/check.h"
#include "cuda/check/motion.h"
#include "cuda/check/scenes.h"
#include "space/frame/device_choice.h"
#include "space/pairs/sweep.h"
#include "space/paper/brute_force.h"
#include "tests/bench/csv.h"

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
      finders_[used] = std::make_unique<CudaSweep>(devicesFor(used));
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
  CudaSweep& on(int devices) { return *finders_.at(devices); }
  int threads() const { return threads_; }

 private:
  int threadsFor(std::size_t boxes) const {
    if (boxes < 4096) return 1;
    return static_cast<int>(std::min<std::size_t>(threads_, boxes / 1024));
  }

  const int threads_;
  BruteForce<float> brute_force_;
  Sweep<float> sweep_;
  std::map<int, std::unique_ptr<CudaSweep>> finders_;
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

// The back end Auto, with its devices ready; fixed ways are numbers of devices.
constexpr int by_choice = -1;  // fixed: no number of devices

std::string nameOf(int way) {
  return way == by_choice ? "auto" : std::to_string(way);
}

// Frames of one scene in any way; Auto goes on learning from frame to frame, as in a space. All
// boxes move between frames.
class Frames {
 public:
  Frames(Finders& finders, BoxSet& boxes, int devices)
      : finders_(finders),
        boxes_(boxes),
        motion_(boxes),
        candidates_(DeviceChoice::Candidates(true, devices)) {}

  double find(int way) {
    motion_.advance();
    if (way != by_choice) return finders_.find(way, boxes_, pairs_);
    decision_ = choice_.decide(boxes_.size, candidates_);
    chosen_ = decision_.devices;
    const double ms = finders_.find(chosen_, boxes_, pairs_);
    choice_.learn(decision_, chosen_, boxes_.size, pairs_.size(), ms);
    return ms;
  }
  int last(int way) const { return way == by_choice ? chosen_ : way; }
  std::size_t pairs() const { return pairs_.size(); }

 private:
  Finders& finders_;
  const BoxSet& boxes_;
  Motion motion_;
  const DeviceChoice::Candidates candidates_;
  DeviceChoice choice_;
  int chosen_ = 0;
  DeviceChoice::Decision decision_;
  PairList pairs_;
};

// As in a program that stays with one way: frames follow each other, the first of each few is not
// counted. All ways take turns at that, so that a disturbance meets all, every other time the other
// way round, as it matters who went before.
std::map<int, std::vector<double>> takeTurns(Frames& frames, const std::vector<int>& ways,
                                             double budget_ms) {
  constexpr int uncounted = 2, counted = 3;  // fixed: how times are taken
  constexpr std::size_t least = 5 * counted, most = 67 * counted;
  // Storage comes into being, and Auto makes up its mind.
  for (const int way : ways)
    for (int i = 0; i < (way == by_choice ? 40 : 4); ++i) frames.find(way);
  std::map<int, std::vector<double>> times;
  std::size_t taken = 0;
  std::vector<int> turns = ways;
  for (double ms = 0; taken < least || (ms < budget_ms && taken < most); taken += counted) {
    for (const int way : turns)
      for (int i = 0; i < uncounted + counted; ++i) {
        const double frame = frames.find(way);
        ms += frame;
        if (i >= uncounted) times[way].push_back(frame);
      }
    std::reverse(turns.begin(), turns.end());
  }
  return times;
}

// Where a frame's time goes: the kernels of the first device, and the host's part.
std::vector<CudaStageTimes> stagesOf(Frames& frames, Finders& finders, int way) {
  std::vector<CudaStageTimes> stages;
  if (way <= 0) return stages;
  CudaSweep& finder = finders.on(way);
  finder.measure(true);
  for (int i = 0; i < 9; ++i) {
    frames.find(way);
    stages.push_back(finder.times());
  }
  finder.measure(false);
  return stages;
}

void recordScene(const Scene& scene, std::size_t size, const std::vector<int>& ways,
                 double budget_ms, Finders& finders, bench::Csv& csv) {
  BoxSet boxes;
  scene.fill(size, 11, boxes);
  Frames frames(finders, boxes, *std::max_element(ways.begin(), ways.end()));
  const auto times = takeTurns(frames, ways, budget_ms);
  for (const int way : ways) {
    const int chosen = frames.last(way);
    bench::Row row =
        rowOf(scene.name, size, nameOf(way), finders.threads(), times.at(way), frames.pairs());
    addStages(row, stagesOf(frames, finders, way));
    csv.write(row.add("chosen", chosen));
  }
  std::fprintf(stderr, "%s %zu\n", scene.name.c_str(), size);
}

}  // namespace

bool recordTimes(const std::string& path, std::size_t most, int threads, int devices) {
  bench::Csv csv({path});
  std::vector<int> ways = {0};
  for (int used = 1; used <= devices; used *= 2) ways.push_back(used);
  ways.push_back(by_choice);
  {
    Finders finders(threads, devices);
    for (const std::size_t size :
         {2,       10,      30,      100,     300,      1000,     2000,
          4000,    10000,   20000,   50000,   100000,   200000,   500000,
          1000000, 2000000, 4000000, 8000000, 16000000, 32000000, 64000000})
      if (size <= most)
        recordScene(sceneOf("cube"), size, ways, size > 500000 ? 1000 : 300, finders, csv);
  }
  Finders finders(threads, 1);
  for (const Scene& scene : scenes())
    if (scene.name != "cube" && most >= 1000000)
      recordScene(scene, std::min<std::size_t>(scene.most, 1000000), {0, 1}, 300, finders, csv);
  return true;
}

}  // namespace cuda_check
