// The parts that find pairs in plain arrays, with every instruction set this processor has: what
// the tests through the public interface cannot choose.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "axis_lists.h"
#include "axis_parts.h"
#include "brute_force.h"
#include "pair_order.h"
#include "parallel.h"
#include "query_tree.h"
#include "radix_sort.h"
#include "round_outward.h"
#include "simd/kernels.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"
#include "support/scenes.h"
#include "sweep.h"

using namespace ode_parallel_sap;

namespace {

// Boxes, filters and their pairs by the formula, in the order of the report.
struct Case {
  BoxSet boxes;
  std::vector<Pair> exact, possible;  // by the exact bounds; by the boxes
};

bool overlap(const double* a, const double* b) {
  return a[0] <= b[1] && b[0] <= a[1] && a[2] <= b[3] && b[2] <= a[3] && a[4] <= b[5] &&
         b[4] <= a[5];
}

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
  std::vector<std::vector<double>> bounds(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      bounds[i].push_back(scene[i].low[axis]);
      bounds[i].push_back(scene[i].high[axis]);
      boxes.wide_boxes[i].lower[axis] = scene[i].low[axis];
      boxes.wide_boxes[i].upper[axis] = scene[i].high[axis];
    }
    boxes.exact = roundOutward<double>(bounds[i].data(), boxes.boxes[i]).exact && boxes.exact;
    boxes.bits[i] = {1u << i % 3, 1u << i % 2 | 4};
    boxes.bodies[i] = i % 5 == 0 ? static_cast<std::uint32_t>(1 + i % 4) : 0;
  }
  boxes.exact = boxes.exact || wide;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j) {
      const FilterBits a = boxes.bits[i], b = boxes.bits[j];
      if (filtered && !(a.category & b.collide) && !(b.category & a.collide)) continue;
      if (filtered && boxes.bodies[i] && boxes.bodies[i] == boxes.bodies[j]) continue;
      if (overlap(bounds[i].data(), bounds[j].data()))
        made.exact.push_back(makePair(static_cast<Slot>(i), static_cast<Slot>(j)));
    }
  return made;
}

std::vector<Pair> found(PairFinder& finder, const BoxSet& boxes, int threads, PairList& list) {
  finder.find(boxes, threads, list);
  std::vector<Pair> all;
  for (const Buffer<Pair>& part : list.parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// Every pair owed is there; those beyond it are unsure; all are ascending.
void check(const std::vector<Pair>& got, const Case& wanted) {
  std::vector<Pair> plain, sure;
  for (const Pair pair : got) {
    plain.push_back(pair & ~unsure_bit);
    if (!isUnsure(pair)) sure.push_back(pair);
  }
  REQUIRE(std::adjacent_find(plain.begin(), plain.end(), std::greater_equal<Pair>()) ==
          plain.end());
  REQUIRE(std::includes(plain.begin(), plain.end(), wanted.exact.begin(), wanted.exact.end()));
  REQUIRE(std::includes(wanted.exact.begin(), wanted.exact.end(), sure.begin(), sure.end()));
}

void checkUnsureStretches(const PairList& list) {
  std::size_t covered = 0, all = 0;
  for (const PairList::Stretch& stretch : list.unsure)
    covered += std::count_if(list.parts[stretch.part].begin() + stretch.begin,
                             list.parts[stretch.part].begin() + stretch.end, isUnsure);
  for (const Buffer<Pair>& part : list.parts)
    all += std::count_if(part.begin(), part.end(), isUnsure);
  REQUIRE(covered == all);
}

}  // namespace

TEST_CASE("Every instruction set finds the same pairs, in floats and in doubles") {
  const std::uint64_t seed = sap_test::seedOr(1);
  INFO("seed " << seed);
  const KernelSet& best = kernelSet();
  for (const KernelSet* const* set = allKernelSets(); *set; ++set) {
    chooseKernelSet(**set);
    for (const sap_test::BoxScene& scene : sap_test::boxScenes())
      for (const bool wide : {false, true})
        for (const bool filtered : {false, true}) {
          INFO((*set)->name << ", " << scene.name << (wide ? ", doubles" : ", floats")
                            << (filtered ? ", filtered" : ""));
          const Case wanted = makeCase(scene.make(701, seed), wide, filtered);
          Sweep<float> sweep;
          Sweep<double> wide_sweep;
          BruteForce<float> brute_force;
          BruteForce<double> wide_brute_force;
          PairFinder& first = wide ? static_cast<PairFinder&>(wide_sweep) : sweep;
          PairFinder& second = wide ? static_cast<PairFinder&>(wide_brute_force) : brute_force;
          PairList swept, tested;
          const std::vector<Pair> pairs = found(first, wanted.boxes, 2, swept);
          check(pairs, wanted);
          checkUnsureStretches(swept);
          check(found(second, wanted.boxes, 3, tested), wanted);
          checkUnsureStretches(tested);
          AxisLists<float> axis_lists;
          AxisLists<double> wide_axis_lists;
          PairFinder& third = wide ? static_cast<PairFinder&>(wide_axis_lists) : axis_lists;
          REQUIRE(found(third, wanted.boxes, 3, tested) == pairs);
          checkUnsureStretches(tested);
        }
  }
  chooseKernelSet(best);
}

TEST_CASE("Crowds that no key tells apart are still cut into cells") {
  // Exponentially nested crowds: each a millionth of the last one's size.
  const std::uint64_t seed = sap_test::seedOr(1);
  INFO("seed " << seed);
  sap_test::Random random(seed);
  std::vector<sap_test::Box> scene;
  double size = 1;
  for (int level = 0; level < 5; ++level, size *= 1e-6)
    for (int i = 0; i < 700; ++i) {
      sap_test::Box box;
      for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = size * random.unit();
        box.high[axis] = box.low[axis] + size * 0.05;
      }
      scene.push_back(box);
    }
  for (const bool wide : {false, true}) {
    const Case wanted = makeCase(scene, wide, false);
    PairList list;
    Sweep<float> sweep;
    Sweep<double> wide_sweep;
    check(found(wide ? static_cast<PairFinder&>(wide_sweep) : sweep, wanted.boxes, 2, list),
          wanted);
  }
}

namespace {

// Moves the boxes of a case in ways that keep the sorted lists busy: a little, far, out of the
// scene (NaN) and back, to infinity and inside out; and changes their number.
void changeScene(std::vector<sap_test::Box>& scene, int frame, sap_test::Random& random) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const bool all = frame % 7 == 3;
  for (sap_test::Box& box : scene) {
    if (!all && random.below(40) != 0) continue;
    const unsigned kind = static_cast<unsigned>(random.below(20));
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = 9 * random.unit();
      box.high[axis] = kind == 0   ? nan
                       : kind == 1 ? box.low[axis] - random.unit()
                       : kind == 2 ? infinity
                                   : box.low[axis] + random.unit();
      if (kind == 0) box.low[axis] = nan;
      if (kind == 3) box.low[axis] = -infinity;
      if (kind == 4) box.low[axis] = box.high[axis] = std::floor(box.low[axis]) - 4;
    }
  }
  if (frame % 5 == 4) scene.resize(scene.size() - 30);
  if (frame % 5 == 1) scene.insert(scene.end(), scene.begin(), scene.begin() + 20);
}

}  // namespace

TEST_CASE("Lists kept from frame to frame give what new ones give, whatever changes") {
  const std::uint64_t seed = sap_test::seedOr(2);
  INFO("seed " << seed);
  for (const bool wide : {false, true}) {
    sap_test::Random random(seed);
    std::vector<sap_test::Box> scene = sap_test::denseCube(600, seed);
    AxisLists<float> axis_lists;
    AxisLists<double> wide_axis_lists;
    PairFinder& finder = wide ? static_cast<PairFinder&>(wide_axis_lists) : axis_lists;
    PairList list;
    for (int frame = 0; frame < sap_test::scaled(60); ++frame) {
      CAPTURE(wide, frame);
      const Case wanted = makeCase(scene, wide, frame % 2);
      check(found(finder, wanted.boxes, 1 + frame % 4, list), wanted);
      checkUnsureStretches(list);
      changeScene(scene, frame, random);
    }
  }
}

TEST_CASE("The pairs of each axis are counted as they are, before any are listed") {
  const std::uint64_t seed = sap_test::seedOr(3);
  INFO("seed " << seed);
  for (const sap_test::BoxScene& scene : sap_test::boxScenes()) {
    CAPTURE(scene.name);
    const std::vector<sap_test::Box> made = scene.make(500, seed);
    const Case wanted = makeCase(made, true, false);
    EndpointLists<double> lists;
    lists.update(wanted.boxes, 2);
    std::uint64_t all = 0;
    for (int axis = 0; axis < 3; ++axis) {
      std::uint64_t pairs = 0;
      for (std::size_t i = 0; i < made.size(); ++i)
        for (std::size_t j = i + 1; j < made.size(); ++j)
          pairs +=
              made[i].low[axis] <= made[j].high[axis] && made[j].low[axis] <= made[i].high[axis];
      REQUIRE(lists.axis(axis).pairs() == pairs);
      all += pairs;
    }
    AxisLists<double> finder;
    PairList list;
    finder.limit(4 * all - 1);
    REQUIRE_THROWS_AS(finder.find(wanted.boxes, 2, list), ListsTooLong);
    REQUIRE(finder.bytes() < 500 * 300);
    finder.limit(5 * all);
    check(found(finder, wanted.boxes, 2, list), wanted);
  }
}

TEST_CASE("The fullest axis is taken first, the emptiest next") {
  for (std::uint64_t x = 0; x < 3; ++x)
    for (std::uint64_t y = 0; y < 3; ++y)
      for (std::uint64_t z = 0; z < 3; ++z) {
        const std::uint64_t pairs[3] = {x, y, z};
        const AxisChoice axes = chooseAxes({x, y, z});
        REQUIRE((1 << axes.fullest | 1 << axes.second | 1 << axes.third) == 7);
        REQUIRE(pairs[axes.second] <= pairs[axes.third]);
        REQUIRE(pairs[axes.third] <= pairs[axes.fullest]);
      }
}

namespace {

// The pairs that one part of a scene finds: those of its stretch of the fullest axis that its rows
// of the other axes hold too.
std::vector<Pair> pairsOf(const AxisPart& part, const AxisChoice& axes) {
  std::vector<Pair> pairs;
  const AxisRows& fullest = part.rows(axes.fullest);
  for (std::uint64_t place = part.begin(); place < part.end(); ++place) {
    const std::uint32_t row = fullest.rowOf(place);
    const std::uint32_t rank = static_cast<std::uint32_t>(row + 1 + (place - fullest.begins[row]));
    if (!fullest.overlapsRow(rank, row)) continue;
    const std::uint32_t a = fullest.order[row], b = fullest.order[rank];
    bool held = true;
    for (const int axis : {axes.second, axes.third}) {
      const AxisRows& rows = part.rows(axis);
      const auto [low, high] = std::minmax(rows.ranks[a], rows.ranks[b]);
      held = held && high < rows.reach[low] && rows.overlapsRow(high, low);
    }
    const Slot slot_a = part.slotOf(a), slot_b = part.slotOf(b);
    if (held) pairs.push_back(makePair(std::min(slot_a, slot_b), std::max(slot_a, slot_b)));
  }
  return pairs;
}

}  // namespace

TEST_CASE("Parts of a scene hold each pair once between them, in equal stretches") {
  const std::uint64_t seed = sap_test::seedOr(4);
  INFO("seed " << seed);
  sap_test::Random random(seed);
  for (const sap_test::BoxScene& scene : sap_test::boxScenes()) {
    std::vector<sap_test::Box> made = scene.make(400, seed);
    for (int frame = 0; frame < 4; ++frame) changeScene(made, frame, random);
    const Case wanted = makeCase(made, true, false);
    EndpointLists<double> lists;
    lists.update(wanted.boxes, 1);
    const AxisRows* const rows[3] = {&lists.axis(0), &lists.axis(1), &lists.axis(2)};
    const AxisChoice axes = chooseAxes({rows[0]->pairs(), rows[1]->pairs(), rows[2]->pairs()});
    AxisPart part;  // one for all: what it held before must not matter
    for (const int parts : {1, 2, 3, 4, 7, 64}) {
      CAPTURE(scene.name, parts);
      std::vector<Pair> all;
      std::uint64_t covered = 0;
      for (int i = 0; i < parts; ++i) {
        part.cut(rows, axes, i, parts);
        const std::uint64_t size = part.end() - part.begin();
        REQUIRE(size - rows[axes.fullest]->pairs() / parts <= 1);
        REQUIRE(part.end() <= part.rows(axes.fullest).pairs());
        covered += size;
        const std::vector<Pair> found = pairsOf(part, axes);
        all.insert(all.end(), found.begin(), found.end());
      }
      REQUIRE(covered == rows[axes.fullest]->pairs());
      std::sort(all.begin(), all.end());
      REQUIRE(all == wanted.exact);
    }
  }
}

TEST_CASE("Radix sort agrees with a stable sort, for any count, digits and threads") {
  sap_test::Random random(sap_test::seedOr(1));
  for (const std::size_t count : {0, 1, 2, 31, 257, 5000, 40000})
    for (const int bits : {1, 5, 8, 9, 17, 24})
      for (const int threads : {1, 3}) {
        INFO(count << " records, " << bits << " bits, " << threads << " threads");
        std::vector<std::uint64_t> records(count), scratch(count);
        for (std::uint64_t& record : records) record = random.bits();
        std::vector<std::uint64_t> wanted = records;
        const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
        std::stable_sort(wanted.begin(), wanted.end(), [=](std::uint64_t a, std::uint64_t b) {
          return (a >> 32 & mask) < (b >> 32 & mask);
        });
        radixSort(records.data(), scratch.data(), count, 32, bits, threads);
        REQUIRE(records == wanted);
      }
}

TEST_CASE("Rounding outward is the nearest float that is not inside, for any bits") {
  sap_test::Random random(sap_test::seedOr(1));
  const double infinity = std::numeric_limits<double>::infinity();
  const double special[] = {0.0,   -0.0,     1e-310,    -1e-310, 1e-45, 3.4028234e38, 3.5e38,
                            1e300, infinity, -infinity, 1.0,     -1.0,  16777217.0};
  const float highest = std::numeric_limits<float>::infinity();
  for (int round = 0; round < 200000; ++round) {
    double bounds[6];
    for (double& bound : bounds) {
      const std::uint64_t bits = random.bits();
      if (bits % 4 == 0)
        bound = special[bits / 4 % (sizeof special / sizeof *special)];
      else
        std::memcpy(&bound, &bits, sizeof bound);
      if (bound != bound) bound = 1;
    }
    Box box;
    const BoundsFacts facts = roundOutward<double>(bounds, box);
    REQUIRE(!facts.nan);
    bool exact = true;
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = bounds[2 * axis], upper = bounds[2 * axis + 1];
      CAPTURE(lower, upper, box.lower[axis], box.upper[axis]);
      REQUIRE(static_cast<double>(box.lower[axis]) <= lower);
      REQUIRE(static_cast<double>(box.upper[axis]) >= upper);
      if (box.lower[axis] < highest)
        REQUIRE((box.lower[axis] == lower || std::nextafter(box.lower[axis], highest) > lower));
      if (box.upper[axis] > -highest)
        REQUIRE((box.upper[axis] == upper || std::nextafter(box.upper[axis], -highest) < upper));
      exact = exact && box.lower[axis] == lower && box.upper[axis] == upper;
    }
    REQUIRE(facts.exact == exact);
  }
}

TEST_CASE("Parts of a range cover it once, in order") {
  for (const std::size_t count : {0, 1, 7, 16, 1000, 1001})
    for (const int parts : {1, 2, 3, 16})
      for (const std::size_t step : {1, 16}) {
        std::size_t next = 0;
        for (int part = 0; part < parts; ++part) {
          const Range range = partOf(count, part, parts, step);
          REQUIRE(range.begin == next);
          REQUIRE(range.end >= range.begin);
          REQUIRE((range.begin % step == 0 || range.begin == count));
          next = range.end;
        }
        REQUIRE(next == count);
      }
}

TEST_CASE("An exception of any thread reaches the caller, once all are done") {
  for (const int threads : {1, 4})
    REQUIRE_THROWS_AS(runTeam(threads, [](int, int) { throw std::bad_alloc(); }), std::bad_alloc);
}

namespace {

// Whether two boxes still overlap when all their bounds are moved inward by that many floats, as
// exact bounds may be by up to one; boxes of doubles are exact.
template <class Real>
bool overlapShrunk(const BasicBox<Real>& a, const BasicBox<Real>& b, int steps) {
  const auto inward = [steps](Real bound, Real direction) {
    for (int i = 0; i < steps && sizeof(Real) == sizeof(float); ++i)
      bound = std::nextafter(bound, direction * std::numeric_limits<Real>::infinity());
    return bound;
  };
  bool meets = true;
  for (int axis = 0; axis < 3; ++axis)
    meets = meets && inward(a.lower[axis], 1) <= inward(b.upper[axis], -1) &&
            inward(b.lower[axis], 1) <= inward(a.upper[axis], -1);
  return meets;
}

template <class Real>
void checkQueryTree(const sap_test::BoxScene& scene, std::uint64_t seed) {
  sap_test::Random random(seed);
  const std::vector<sap_test::Box> all = scene.make(701, seed);
  BoxSet boxes;
  boxes.size = all.size();
  boxes.wide = sizeof(Real) > sizeof(float);
  boxes.boxes.resize(all.size());
  boxes.wide_boxes.resize(all.size());
  std::vector<BasicBox<Real>> now(all.size() + 20);
  const BasicBox<Real> none = {{NAN, NAN, NAN}, {NAN, NAN, NAN}};
  std::fill(now.begin(), now.end(), none);
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      now[i].lower[axis] = static_cast<Real>(all[i].low[axis]);
      now[i].upper[axis] = static_cast<Real>(all[i].high[axis]);
    }
    if (random.chance(0.02)) now[i] = none;
    std::memcpy(static_cast<void*>(&boxes.boxes[i]), static_cast<const void*>(&now[i]),
                sizeof(Real) == sizeof(float) ? sizeof(Box) : 0);
    std::memcpy(static_cast<void*>(&boxes.wide_boxes[i]), static_cast<const void*>(&now[i]),
                sizeof(Real) == sizeof(float) ? 0 : sizeof(BasicBox<double>));
  }
  QueryTree<Real> tree;
  tree.build(boxes, 2);
  REQUIRE(tree.strayRows() == 0);
  std::vector<Slot> found(now.size() + tree.spare);
  for (int round = 0; round < 60; ++round) {
    const BasicBox<Real>& query = now[random.below(now.size())];
    std::vector<Slot> wanted;
    for (std::size_t i = 0; i < now.size(); ++i)
      if (overlapShrunk(query, now[i], 0)) wanted.push_back(static_cast<Slot>(i));
    const std::size_t count = tree.find(query, found.data());
    std::vector<Slot> got(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count));
    for (Slot& slot : got) {
      const bool unsure = slot & unsure_slot;
      slot &= ~unsure_slot;
      REQUIRE(slot < now.size());
      if (unsure)
        REQUIRE(!overlapShrunk(query, now[slot], 2));
      else
        REQUIRE(overlapShrunk(query, now[slot], 1));
    }
    std::sort(got.begin(), got.end());
    REQUIRE(got == wanted);
    // Some tremble, some are flung away, go or come back; beyond the slots it was built with, too.
    for (int change = 0; change < 12; ++change) {
      const std::size_t i = random.below(now.size());
      const Real by = static_cast<Real>(random.gauss() * (random.chance(0.5) ? 0.01 : 10));
      if (random.chance(0.2))
        now[i] = none;
      else if (!isActive(now[i]))
        now[i] = {{by, by, by}, {by + 1, by + 1, by + 1}};
      else
        for (int axis = 0; axis < 3; ++axis) {
          now[i].lower[axis] += by;
          now[i].upper[axis] += by;
        }
      const bool fits = tree.fits(static_cast<Slot>(i), now[i]);
      const std::size_t rows = tree.strayRows();
      tree.place(static_cast<Slot>(i), now[i]);
      if (fits) REQUIRE(tree.strayRows() == rows);
    }
  }
  REQUIRE(tree.strayRows() > 0);
}

}  // namespace

TEST_CASE("A tree for queries finds what overlaps while boxes move, with every instruction set") {
  const std::uint64_t seed = sap_test::seedOr(1);
  INFO("seed " << seed);
  const KernelSet& best = kernelSet();
  for (const KernelSet* const* set = allKernelSets(); *set; ++set) {
    chooseKernelSet(**set);
    for (const sap_test::BoxScene& scene : sap_test::boxScenes()) {
      INFO((*set)->name << ", " << scene.name);
      checkQueryTree<float>(scene, seed);
      checkQueryTree<double>(scene, seed);
    }
  }
  chooseKernelSet(best);
}
