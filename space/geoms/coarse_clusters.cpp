#include "space/geoms/coarse_clusters.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "space/base/float_steps.h"
#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/round_outward.h"
#include "space/base/tuning.h"
#include "space/geoms/tuning.h"

namespace ode_parallel_sap {

namespace {

constexpr double step_of_floats = 0x1p-22;  // fixed: twice an epsilon

Region counting("coarse clusters: boxes");

constexpr std::uint64_t bias = 1023;  // fixed: of the exponents of doubles

// Of a double below 2^51; what is larger has no fraction worth mentioning. Needs rounding to
// nearest.
double nearestInteger(double value) {
  constexpr double without_fraction = 0x1.8p52;  // fixed: of doubles
  return (value + without_fraction) - without_fraction;
}

// A number for the cell that a box lies in: a power of two wide, about as wide as the box or the
// steps of floats there.
std::uint64_t cellOf(const Box& box) {
  double width = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double lower = box.lower[axis], upper = box.upper[axis];
    width = std::max({width, upper - lower, std::fabs(lower) * step_of_floats});
  }
  // The power of two above the width, of which there is always an inverse.
  const std::uint64_t exponent = std::min(bitsOf(width) >> 52, std::uint64_t{2 * bias - 2}) + 1;
  const double cells = doubleOf((2 * bias - exponent) << 52);
  std::uint64_t hash = exponent;
  for (int axis = 0; axis < 3; ++axis) {
    const double place = nearestInteger(static_cast<double>(box.lower[axis]) * cells);
    hash = (hash ^ bitsOf(place)) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  }
  return hash * 0x9e3779b97f4a7c15u;
}

// Boxes of doubles are counted as the floats that they would be, so that the count does not depend
// on which of the two there are.
Box floatsOf(const BasicBox<double>& box) {
  const double bounds[6] = {box.lower[0], box.upper[0], box.lower[1],
                            box.upper[1], box.lower[2], box.upper[2]};
  Box floats;
  roundOutward(bounds, floats);
  return floats;
}

}  // namespace

std::size_t CoarseClusters::count(const BoxSet& boxes, const Buffer<Slot>& coarse, std::size_t most,
                                  int threads) {
  int bits = 2;  // of a hash
  while (std::size_t{1} << bits < counters_a_box * coarse.size()) ++bits;
  counts_.resizeDiscarding(std::size_t{1} << bits);
  std::fill(counts_.begin(), counts_.end(), 0);
  threads = teamFor(coarse.size(), grains::looked_up, threads);
  std::atomic<std::size_t> pairs{0};
  runTeam(counting, threads, [&](int thread, int team) {
    const Range range = ownPart(coarse.size(), thread, team);
    const auto increment = [team](std::uint16_t* count) {
      return team == 1 ? (*count)++ : addShared(*count, std::uint16_t{1});
    };
    // No count gets as far as 2^16: its own pairs would be too many long before.
    std::uint16_t* places[prefetched_block];
    for (std::size_t begin = range.begin; begin < range.end; begin += prefetched_block) {
      const std::size_t count = std::min(prefetched_block, range.end - begin);
      for (std::size_t i = 0; i < count; ++i) {
        const Slot slot = coarse[begin + i];
        const std::uint64_t cell =
            cellOf(boxes.wide ? floatsOf(boxes.wide_boxes[slot]) : boxes.boxes[slot]);
        places[i] = &counts_[cell >> (64 - bits)];
        prefetchForWriting(places[i]);
      }
      std::size_t found = 0;
      for (std::size_t i = 0; i < count; ++i) found += increment(places[i]);
      if (pairs.fetch_add(found, std::memory_order_relaxed) + found > most) return;
    }
  });
  return pairs;
}

}  // namespace ode_parallel_sap
