#include "case.h"

#include <algorithm>
#include <functional>

#include "catch.hpp"
#include "oracle.h"
#include "space/base/round_to_floats.h"

namespace ode_parallel_sap {

Case makeCase(const std::vector<sap_test::Box>& scene, bool wide, bool filtered) {
  const std::size_t n = scene.size();
  Case made;
  BoxSet& boxes = made.boxes;
  boxes.size = n;
  boxes.wide = wide;
  boxes.boxes.resize(n);
  boxes.wide_boxes.resize(n);
  boxes.bits.resize(n);
  boxes.bodies.resize(n);
  boxes.filter_bits = boxes.filter_bodies = filtered;
  boxes.exact = true;
  for (std::size_t i = 0; i < n; ++i) {
    double bounds[6];
    for (int axis = 0; axis < 3; ++axis) {
      bounds[2 * axis] = scene[i].low[axis];
      bounds[2 * axis + 1] = scene[i].high[axis];
      boxes.wide_boxes[i].lower[axis] = scene[i].low[axis];
      boxes.wide_boxes[i].upper[axis] = scene[i].high[axis];
    }
    boxes.exact = !(roundToFloats<double>(bounds, boxes.boxes[i]) & inexact_bounds) && boxes.exact;
    boxes.bits[i] = {1u << i % 3, 1u << i % 2 | 4};
    boxes.bodies[i] = i % 5 == 0 ? BodyKey{1 + i % 4} << 32 : 0;  // all 64 bits count
  }
  boxes.exact = boxes.exact || wide;
  for (const auto& [i, j] : sap_test::expectedPairs(scene)) {
    const FilterBits a = boxes.bits[i], b = boxes.bits[j];
    if (filtered && !(a.category & b.collide) && !(b.category & a.collide)) continue;
    if (filtered && boxes.bodies[i] && boxes.bodies[i] == boxes.bodies[j]) continue;
    made.exact.push_back(makePair(static_cast<Slot>(i), static_cast<Slot>(j)));
  }
  return made;
}

std::vector<Pair> joined(const PairList& list) {
  std::vector<Pair> all;
  for (const PairList::Run& run : list.runs) all.insert(all.end(), run.begin(), run.end());
  return all;
}

std::vector<Pair> found(PairFinder& finder, const BoxSet& boxes, int threads, PairList& list) {
  finder.find(boxes, threads, list);
  return joined(list);
}

void check(const std::vector<Pair>& got, const Case& wanted) {
  std::vector<Pair> plain, sure;
  for (const Pair pair : got) {
    plain.push_back(pair & ~borderline_bit);
    if (!isMarkedBorderline(pair)) sure.push_back(pair);
  }
  REQUIRE(std::adjacent_find(plain.begin(), plain.end(), std::greater_equal<Pair>()) ==
          plain.end());
  REQUIRE(std::includes(plain.begin(), plain.end(), wanted.exact.begin(), wanted.exact.end()));
  REQUIRE(std::includes(wanted.exact.begin(), wanted.exact.end(), sure.begin(), sure.end()));
}

void checkDecidedRuns(const PairList& list) {
  for (const PairList::Run& run : list.runs)
    REQUIRE((!run.decided || std::none_of(run.begin(), run.end(), isMarkedBorderline)));
}

}  // namespace ode_parallel_sap
