#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "cuda/check/check.h"
#include "cuda/check/scenes.h"
#include "space/pairs/sweep.h"

namespace cuda_check {

using namespace ode_parallel_sap;

namespace {

std::vector<Pair> joined(const PairList& pairs) {
  std::vector<Pair> all;
  for (const PairList::Run& run : pairs.runs) all.insert(all.end(), run.begin(), run.end());
  return all;
}

bool runsAreDecided(const PairList& pairs) {
  for (const PairList::Run& run : pairs.runs)
    if (run.decided && std::any_of(run.begin(), run.end(), isMarkedBorderline)) return false;
  return true;
}

}  // namespace

bool samePairs(const std::string& what, const PairList& expected_list, const PairList& found_list) {
  const std::vector<Pair> expected = joined(expected_list), found = joined(found_list);
  if (expected == found) {
    if (runsAreDecided(found_list)) return true;
    std::printf("FAILED %s: a borderline pair is in a run that is said to be decided\n",
                what.c_str());
    return false;
  }
  const std::size_t at =
      std::mismatch(expected.begin(), expected.begin() + std::min(expected.size(), found.size()),
                    found.begin())
          .first -
      expected.begin();
  std::printf("FAILED %s: %zu pairs expected, %zu found, different from %zu on:", what.c_str(),
              expected.size(), found.size(), at);
  for (std::size_t i = at; i < at + 3; ++i) {
    if (i < expected.size())
      std::printf(" expected %u-%u%s", earlierOf(expected[i]), laterOf(expected[i]),
                  isMarkedBorderline(expected[i]) ? "?" : "");
    if (i < found.size())
      std::printf(" found %u-%u%s", earlierOf(found[i]), laterOf(found[i]),
                  isMarkedBorderline(found[i]) ? "?" : "");
  }
  std::printf("\n");
  return false;
}

std::vector<int> devicesFor(int count) {
  const std::vector<int> real = cudaDevices();
  std::vector<int> devices;
  for (int i = 0; i < count; ++i) devices.push_back(real[i % real.size()]);
  return devices;
}

namespace {

// Finds each scene on every number of devices, and on one by one thread, too, twice: the second
// time pairs come to where they belong, as far as their storage is large enough.
class Comparison {
 public:
  // One finder and one list for all: buffers of all sizes are met again.
  Comparison(int threads, int devices)
      : finder_(devicesFor(devices)), threads_(threads), devices_(devices) {}

  bool isSame(const std::string& what, const BoxSet& boxes, const PairList& expected) {
    bool same = true;
    try {
      for (int used = 1; used <= devices_; ++used)
        same = isSameBy(used, threads_, what, boxes, expected) && same;
      for (int time = 0; time < 2; ++time) same = isSameBy(1, 1, what, boxes, expected) && same;
    } catch (const std::exception& failure) {
      std::printf("FAILED %s: %s\n", what.c_str(), failure.what());
      return false;
    }
    return same;
  }

 private:
  bool isSameBy(int used, int threads, const std::string& what, const BoxSet& boxes,
                const PairList& expected) {
    const std::string how =
        what + ", " + std::to_string(used) + " devices, " + std::to_string(threads) + " threads";
    finder_.useDevices(used);
    finder_.find(boxes, threads, found_);
    const bool same = samePairs(how, expected, found_);
    if (finder_.devicesUsed() == used) return same;
    std::printf("FAILED %s: %d were used\n", how.c_str(), finder_.devicesUsed());
    return false;
  }

  CudaSweep finder_;
  const int threads_, devices_;
  PairList found_;
};

}  // namespace

bool compareAll(std::size_t most, int threads, int devices, const std::string& only) {
  const std::size_t sizes[] = {0, 1, 2, 3, 31, 32, 33, 63, 65, 257, 1234, 5000, 100003, 1000000};
  Comparison comparison(threads, devices);
  Sweep<float> cpu;
  BoxSet boxes;
  PairList expected;
  bool good = true;
  for (const Scene& scene : scenes()) {
    if (!only.empty() && scene.name != only) continue;
    std::size_t pairs = 0, borderline = 0, checked = 0;
    for (const std::size_t size : sizes) {
      if (size > std::min(most, scene.most)) continue;
      for (const std::uint64_t seed : {1, 2}) {
        if (seed == 2 && size > 200000) continue;
        scene.fill(size, seed, boxes);
        cpu.find(boxes, threads, expected);
        const std::string what =
            scene.name + ", " + std::to_string(size) + " boxes, seed " + std::to_string(seed);
        good = comparison.isSame(what, boxes, expected) && good;
        pairs += expected.size();
        for (const PairList::Run& part : expected.runs)
          borderline += std::count_if(part.begin(), part.end(), isMarkedBorderline);
        ++checked;
      }
    }
    std::printf("%-10s %2zu runs, %zu pairs, %zu of them borderline: %s\n", scene.name.c_str(),
                checked, pairs, borderline, good ? "same" : "DIFFERENT");
    std::fflush(stdout);
  }
  return good;
}

}  // namespace cuda_check
