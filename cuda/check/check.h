// The parts of the check program. Each returns whether all went well.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "cuda/finder/cuda_sweep.h"
#include "space/base/box_set.h"
#include "space/base/pair_list.h"

namespace cuda_check {

// Whether two lists hold the same pairs in the same order, marks included, and no borderline
// pair is in a run that is said to be decided. Prints the first difference.
bool samePairs(const std::string& what, const ode_parallel_sap::PairList& expected,
               const ode_parallel_sap::PairList& found);

// The first `count` devices; where there are fewer, they stand for several.
std::vector<int> devicesFor(int count);

// Each scene, or `only` one, at each size up to `most` against the CPU, on 1 to `devices` devices.
bool compareAll(std::size_t most, int threads, int devices, const std::string& only = "");
// Every CUDA call of a frame fails once; of one that is measured, too.
bool checkFaults(int threads, int devices, bool measuring = false);
// Two finders on two threads; many finders one after the other.
bool checkSharing(int threads);

// Storage whose pages are locked: given back, taken again, and copied by a fork.
bool checkLocks(int threads);

// The method AxisLists, on one device and on all, in one and in several parts: the pairs of the
// sweep, each call failing in turn, and its limit of memory. Then times.
bool checkAxisLists(std::size_t most, int threads);
void timeAxisLists(int threads);

// Medians, as CSV lines and a table.
bool timeAll(bool quick, int threads);
// Medians of the dense cube on 1, 2, 4 ... devices, as a table.
bool timeDevices(std::size_t most, int threads, int devices);

// The dense cube from 2 to `most` boxes on the processor, on 1, 2, 4 ... devices in turn, and as
// the back end Auto chooses; every other scene on the processor and one device. As CSV.
bool recordTimes(const std::string& path, std::size_t most, int threads, int devices);

// A few frames of one scene, for a profiler.
void profile(const std::string& scene, std::size_t size, int threads);

}  // namespace cuda_check
