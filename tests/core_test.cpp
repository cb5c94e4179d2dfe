// The parts that find pairs in plain arrays, with every instruction set this processor has: what
// the tests through the public interface cannot choose.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "space/cells/cell_trees.h"
#include "space/coherence/incremental.h"
#include "space/data/parallel.h"
#include "space/data/round_outward.h"
#include "space/extract/paper/axis_lists.h"
#include "space/extract/paper/brute_force.h"
#include "space/extract/sweep.h"
#include "space/simd/kernels.h"
#include "space/sort/radix_sort.h"
#include "space/update/coarse_clusters.h"
#include "support/case.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"

using namespace ode_parallel_sap;

namespace {

// Calls visit(case, wide) for the scene in floats and in doubles, filtered and not, with every
// instruction set.
template <class Visit>
void withAllSets(const std::vector<sap_test::Box>& scene, Visit visit) {
  const KernelSet& best = kernelSet();
  for (const bool wide : {false, true})
    for (const bool filtered : {false, true}) {
      const Case wanted = makeCase(scene, wide, filtered);
      for (const KernelSet* const* set = allKernelSets(); *set; ++set) {
        INFO((*set)->name << (wide ? ", doubles" : ", floats") << (filtered ? ", filtered" : ""));
        chooseKernelSet(**set);
        visit(wanted, wide);
      }
    }
  chooseKernelSet(best);
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
          checkBorderlineSegments(swept);
          check(found(second, wanted.boxes, 3, tested), wanted);
          checkBorderlineSegments(tested);
          AxisLists<float> axis_lists;
          AxisLists<double> wide_axis_lists;
          PairFinder& third = wide ? static_cast<PairFinder&>(wide_axis_lists) : axis_lists;
          REQUIRE(found(third, wanted.boxes, 3, tested) == pairs);
          checkBorderlineSegments(tested);
        }
  }
  chooseKernelSet(best);
}

TEST_CASE("Trees of several classes hold each class's boxes, whoever packs them") {
  const std::size_t cells_of_class[] = {1, 0, 300, 16, 17, 1000};
  std::vector<CellClass> classes;
  std::size_t cells = 0;
  for (const std::size_t count : cells_of_class) {
    classes.push_back({cells, cells + count});
    cells += count;
  }
  // Three boxes a cell, box i from i to i + 1 on each axis; a class's bits are its own.
  BoxSet boxes;
  boxes.size = 3 * cells;
  boxes.filter_bits = true;
  boxes.boxes.resize(boxes.size);
  boxes.bits.resize(boxes.size);
  std::vector<std::uint32_t> starts;
  for (std::uint32_t cell = 0; cell <= cells; ++cell) starts.push_back(3 * cell);
  for (std::size_t of = 0; of < classes.size(); ++of)
    for (std::size_t i = 3 * classes[of].first_cell; i < 3 * classes[of].last_cell; ++i) {
      const float at = static_cast<float>(i);
      boxes.boxes[i] = {{at, at, at}, {at + 1, at + 1, at + 1}};
      boxes.bits[i] = {std::uint32_t{1} << of, std::uint32_t{1} << of};
    }
  CellTrees<float> trees;
  for (const int threads : {1, 2, 5}) {
    INFO(threads << " threads");
    trees.build(boxes, {nullptr, starts.data()}, {classes.data(), classes.size()}, threads);
    REQUIRE(trees.count() == classes.size());
    REQUIRE(trees.cells() == cells);
    for (std::size_t of = 0; of < classes.size(); ++of) {
      INFO("class " << of);
      const TreeView<float>& view = trees.views()[of];
      REQUIRE(trees.cells(of) == cells_of_class[of]);
      REQUIRE(view.first_cell == classes[of].first_cell);
      if (cells_of_class[of] == 0) continue;
      CHECK(trees.filters(of).category == std::uint32_t{1} << of);
      CHECK(trees.filters(of).collide == std::uint32_t{1} << of);
      for (std::size_t cell = 0; cell < trees.cells(of); ++cell) {
        const float low = static_cast<float>(3 * (view.first_cell + cell));
        const BasicBox<float> bounds = trees.boundsOf(view.first_cell + cell);
        REQUIRE(bounds.lower[1] == low);
        REQUIRE(bounds.upper[2] == low + 3);
        REQUIRE(view.levels[0][cell].lower[0][2] == low + 2);
        REQUIRE(view.ids[cell].slot[2] == 3 * (view.first_cell + cell) + 2);
        REQUIRE(view.filters[cell].category[2] == std::uint32_t{1} << of);
      }
      // The top: the places that are used are the class's cells.
      REQUIRE(view.groups[view.depth - 1] == 1);
      const Group<float>& top = view.levels[view.depth - 1][0];
      CHECK(top.lower[0][0] == static_cast<float>(3 * view.first_cell));
      float last = 0;
      for (const float upper : top.upper[0]) last = std::isnan(upper) ? last : upper;
      CHECK(last == static_cast<float>(3 * classes[of].last_cell));
    }
  }
  // Fewer classes, without filters; and none.
  boxes.filter_bits = false;
  trees.build(boxes, {nullptr, starts.data()}, {classes.data(), 3}, 2);
  REQUIRE(trees.count() == 3);
  CHECK(trees.cells() == 301);
  CHECK(trees.views()[2].filters == nullptr);
  CHECK(trees.boundsOf(300).upper[0] == 903);
  trees.build(boxes, {nullptr, starts.data()}, {nullptr, 0}, 2);
  CHECK(trees.count() == 0);
  CHECK(trees.cells() == 0);
}

TEST_CASE("Cells that are more than are gathered at a time are met once each") {
  const std::uint64_t seed = sap_test::seedOr(5);
  INFO("seed " << seed);
  sap_test::Random random(seed);
  // Cubes of two sizes and bars through all of them: hundreds of cells reach any other.
  std::vector<sap_test::Box> scene(9000);
  for (std::size_t i = 0; i < scene.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double size = i % 3 == 0 ? 0.2 : i % 3 == 1 ? 0.02 : i / 3 % 3 == axis ? 3 : 0.003;
      scene[i].low[axis] = random.between(0, 1);
      scene[i].high[axis] = scene[i].low[axis] + size * random.between(0.5, 1);
    }
  withAllSets(scene, [](const Case& wanted, bool wide) {
    Sweep<float> sweep;
    Sweep<double> wide_sweep;
    PairList list;
    check(found(wide ? static_cast<PairFinder&>(wide_sweep) : sweep, wanted.boxes, 2, list),
          wanted);
  });
}

TEST_CASE("A row without columns asks for no room and writes nothing") {
  constexpr std::size_t places = 400;
  const Box box = {{0, 0, 0}, {1, 1, 1}};
  BoxSet boxes;
  boxes.size = places;
  boxes.boxes.resize(places);
  std::fill(boxes.boxes.begin(), boxes.boxes.end(), box);
  std::vector<std::uint32_t> starts;
  for (std::uint32_t start = 0; start <= places; start += group_size) starts.push_back(start);
  CellTrees<float> cells;
  const CellClass all = {0, starts.size() - 1};
  cells.build(boxes, {nullptr, starts.data()}, {&all, 1}, 1, CellTrees<float>::Levels::cells_only);
  const std::uint64_t untouched = ~std::uint64_t{0};
  for (const KernelSet* const* set = allKernelSets(); *set; ++set)
    for (const std::size_t row : {5, 15, 16, 399}) {
      INFO((*set)->name << ", row " << row);
      std::vector<std::uint64_t> words(group_size, untouched);
      PairSink sink = {words.data(), words.data(),
                       [](PairSink&, std::size_t) { FAIL("room was asked for"); }};
      (*set)->narrow.trianglePairs(cells.views()[0], {places, row, row + 1, row, row + 1}, true,
                                   sink);
      CHECK(sink.next == words.data());
      CHECK(words == std::vector<std::uint64_t>(group_size, untouched));
    }
}

TEST_CASE("The instruction set that is chosen is the one that runs, and each has its name") {
  const KernelSet& best = kernelSet();
  CHECK(&best == allKernelSets()[0]);
  std::vector<std::string> names;
  for (const KernelSet* const* set = allKernelSets(); *set; ++set) {
    chooseKernelSet(**set);
    CHECK(&kernelSet() == *set);
    CHECK(&kernels<float>() == &(*set)->narrow);
    CHECK(&kernels<double>() == &(*set)->wide);
    CHECK(kernelSetNamed((*set)->name) == *set);
    names.push_back((*set)->name);
  }
  chooseKernelSet(best);
  CHECK(names.back() == "portable");
  for (const char* const name : {"", "mmx", "sse", "portable "})
    CHECK(kernelSetNamed(name) == nullptr);
}

namespace {

// The pairs of `wanted` that a slot of `changed` is in, found by it and by all others in a tree.
template <class Real>
void checkChanged(const Case& wanted, const Buffer<Slot>& changed) {
  Sweep<Real> base;
  Incremental<Real> incremental;
  PairList list;
  base.build(wanted.boxes, 2);
  incremental.start(base, wanted.boxes.size, wanted.boxes);
  incremental.find(wanted.boxes, changed, 2, list);
  Case part;
  const auto isChanged = [&](Slot slot) {
    return std::binary_search(changed.begin(), changed.end(), slot);
  };
  for (const Pair pair : wanted.exact)
    if (isChanged(earlierOf(pair)) || isChanged(laterOf(pair))) part.exact.push_back(pair);
  check({list.parts[0].begin(), list.parts[0].end()}, part);
  checkBorderlineSegments(list);
}

}  // namespace

TEST_CASE("A few boxes, some of which reach all others, find their pairs in the tree of the rest") {
  const std::uint64_t seed = sap_test::seedOr(1);
  INFO("seed " << seed);
  constexpr std::size_t n = 6000, interval = 97, giants = 20;
  std::vector<sap_test::Box> scene = sap_test::denseCube(n, seed);
  for (std::size_t i = 0; i < giants; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      scene[i * 3 * interval].low[axis] -= 10.0 * static_cast<double>(i % 3);
      scene[i * 3 * interval].high[axis] += 10.0 * static_cast<double>(i % 4);
    }
  Buffer<Slot> changed;
  for (std::size_t slot = 0; slot < n; slot += interval) changed.push_back(static_cast<Slot>(slot));
  withAllSets(scene, [&](const Case& wanted, bool wide) {
    if (wide)
      checkChanged<double>(wanted, changed);
    else
      checkChanged<float>(wanted, changed);
  });
}

TEST_CASE("Clusters that no key tells apart are still cut into cells") {
  // Exponentially nested clusters: each a millionth of the last one's size.
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
  for (int round = 0; round < sap_test::scaled(200000); ++round) {
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

TEST_CASE("Rounding outward in vectors gives what it gives one by one, for boxes of every kind") {
  sap_test::Random random(sap_test::seedOr(1));
  const double special[] = {0.0, -0.0, NAN, HUGE_VAL, -HUGE_VAL, 1e-310, 3.5e38, 1.7e308, -1.7e308};
  for (int round = 0; round < sap_test::scaled(200000); ++round) {
    const double size = std::pow(10, random.between(-60, 60));
    double bounds[6];
    for (int axis = 0; axis < 3; ++axis) {
      bounds[2 * axis] = size * random.gauss() * std::pow(10, random.between(0, 12));
      bounds[2 * axis + 1] = bounds[2 * axis] + size * random.between(0, 1);
    }
    if (random.chance(0.2)) bounds[random.below(6)] = special[random.below(9)];
    if (random.chance(0.1)) std::swap(bounds[0], bounds[1]);
    CAPTURE(bounds[0], bounds[1], bounds[2], bounds[3], bounds[4], bounds[5]);
    Box box, wanted;
    const BoundsFacts facts = roundOutward<double>(bounds, box);
    const BoundsFacts truth = roundOutwardOneByOne<double>(bounds, wanted);
    REQUIRE(facts.nan == truth.nan);
    if (truth.nan) continue;  // the box is of no use
    REQUIRE(std::memcmp(&box, &wanted, sizeof box) == 0);
    REQUIRE(facts.exact == truth.exact);
    REQUIRE(facts.unbounded == truth.unbounded);
    REQUIRE(facts.coarse == truth.coarse);
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

TEST_CASE(
    "A thread takes its own part in order, then what is left, and every index is taken once") {
  for (const std::size_t count : {0, 1, 31, 32, 33, 1234, 10007})
    for (const std::size_t chunk : {1, 5, 32, 2000})
      for (const int team : {1, 2, 3, 16, 64, 65, 200}) {
        CAPTURE(count, chunk, team);
        PartQueue queue(count, chunk, team);
        const int thread = std::min(team, 64) / 2;  // fixed: larger teams share 64 parts
        const Range own = partOf(count, thread, std::min(team, 64), chunk);
        std::vector<int> taken(count);
        std::size_t next = own.begin;
        for (Range range; queue.next(range, thread);) {
          if (next < own.end) REQUIRE(range.begin == next);
          next = range.end;
          REQUIRE((range.begin < range.end && range.end - range.begin <= chunk));
          REQUIRE(range.end <= count);
          for (std::size_t i = range.begin; i < range.end; ++i) ++taken[i];
        }
        CHECK(std::all_of(taken.begin(), taken.end(), [](int times) { return times == 1; }));
      }
}

TEST_CASE("Threads that take from one another's parts take every index once") {
  static Region region("parts");
  std::vector<std::atomic<int>> taken(100003);
  for (const int threads : {1, 2, 7, 16}) {
    for (auto& times : taken) times = 0;
    runParts(region, threads, taken.size(), 3, [&](Range range, int thread) {
      if (thread == 0) std::this_thread::yield();
      for (std::size_t i = range.begin; i < range.end; ++i) ++taken[i];
    });
    CHECK(std::all_of(taken.begin(), taken.end(), [](const auto& times) { return times == 1; }));
  }
}

TEST_CASE("An exception of any thread reaches the caller, once all are done") {
  static Region region("exceptions");
  for (const int threads : {1, 4})
    REQUIRE_THROWS_AS(runTeam(region, threads, [](int, int) { throw std::bad_alloc(); }),
                      std::bad_alloc);
}

TEST_CASE("Coarse boxes are a cluster where they are close together, not where they are many") {
  constexpr std::size_t count = 20000;
  sap_test::Random random(71);
  BoxSet boxes;
  boxes.size = count;
  boxes.boxes.resize(count);
  boxes.wide_boxes.resize(count);
  Buffer<Slot> coarse;
  for (Slot slot = 0; slot < count; ++slot) coarse.push_back(slot);
  CoarseClusters clusters;
  int threads = 1;
  const auto pairs = [&](bool wide, std::size_t most) {
    boxes.wide = wide;
    return clusters.count(boxes, coarse, most, threads);
  };
  const auto place = [&](double distance, double spread) {
    for (std::size_t i = 0; i < count; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const double lower = distance + random.between(-spread, spread), upper = lower + 1;
        boxes.wide_boxes[i].lower[axis] = lower;
        boxes.wide_boxes[i].upper[axis] = upper;
        boxes.boxes[i].lower[axis] = std::nextafter(static_cast<float>(lower), -INFINITY);
        boxes.boxes[i].upper[axis] = std::nextafter(static_cast<float>(upper), INFINITY);
      }
  };
  for (const auto& [wide, team] : {std::pair{false, 1}, {true, 1}, {false, 3}, {true, 3}}) {
    threads = team;
    INFO((wide ? "doubles" : "floats") << ", threads " << threads);
    place(1e9, 1e8);
    const std::size_t few = pairs(wide, count);
    CHECK(few < count / 10);
    place(1e9, 10);
    CHECK(pairs(wide, count) > count);
    CHECK(pairs(wide, count * count) > count * count / 20);
    // The largest of all, and the smallest.
    place(3e38, 1e37);
    CHECK(pairs(wide, count) < count / 10);
    place(0, 0);
    for (std::size_t i = 0; i < count; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        boxes.boxes[i].upper[axis] = boxes.boxes[i].lower[axis] = 0;
        boxes.wide_boxes[i].upper[axis] = boxes.wide_boxes[i].lower[axis] = 0;
      }
    CHECK(pairs(wide, count * count) == count * (count - 1) / 2);
  }
}
