// The parts that find pairs in plain arrays, with every instruction set this processor has: what
// the tests through the public interface cannot choose.
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <set>
#include <thread>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/round_to_floats.h"
#include "space/pairs/cell_order.h"
#include "space/pairs/sweep.h"
#include "space/simd/kernels.h"
#include "support/case.h"

using namespace ode_parallel_sap;

TEST_CASE("A row is whole that meets more cells, and is longer, than is met or stored at once") {
  // Two cells of boxes around all others, which are apart.
  constexpr Slot large = 17, all = 70000;
  BoxSet boxes;
  boxes.size = all;
  boxes.exact = true;
  boxes.boxes.resize(all);
  std::vector<Pair> owed;
  for (Slot slot = 0; slot < all; ++slot) {
    const float x = static_cast<float>(slot);
    boxes.boxes[slot] = {{slot < large ? 0 : x, 0, 0}, {slot < large ? all : x + 0.5f, 1, 1}};
    for (Slot later = slot + 1; slot < large && later < all; ++later)
      owed.push_back(makePair(slot, later));
  }
  Sweep<float> sweep;
  PairList list;
  const bool whole = found(sweep, boxes, 2, list) == owed;  // not all of them in a message
  REQUIRE(whole);
}

TEST_CASE(
    "A borderline pair is noted wherever it stands in its row, and none where there is none") {
  const KernelSet& best = kernelSet();
  for (const KernelSet* const* set = allKernelSets(); *set; ++set)
    for (Slot all = 2; all < 40; ++all)
      for (Slot touching = 0; touching < all; ++touching) {  // the first one; 0: none
        INFO((*set)->name << ", " << all << " boxes, place " << touching);
        chooseKernelSet(**set);
        BoxSet boxes;
        boxes.size = all;
        boxes.boxes.growTo(all, {{0, 0, 0}, {2, 1, 1}});
        boxes.boxes[0].upper[0] = 1;
        if (touching) boxes.boxes[touching].lower[0] = 1;
        Sweep<float> sweep;
        PairList list;
        const std::vector<Pair> pairs = found(sweep, boxes, 1, list);
        REQUIRE(pairs.size() == all * (all - 1) / 2);
        for (std::size_t i = 0; i < pairs.size(); ++i)
          REQUIRE(isMarkedBorderline(pairs[i]) == (i + 1 == touching));
        for (const PairList::Run& run : list.runs) REQUIRE((touching || run.decided));
        checkDecidedRuns(list);
      }
  chooseKernelSet(best);
}

namespace {

// Unit boxes side by side, in rows.
BoxSet layerOfBoxes(std::size_t count, Slot row = 128) {
  BoxSet boxes;
  boxes.size = count;
  boxes.exact = true;
  boxes.boxes.resize(count);
  for (Slot slot = 0; slot < count; ++slot) {
    const float x = static_cast<float>(slot % row), y = static_cast<float>(slot / row);
    boxes.boxes[slot] = {{x, y, 0}, {x + 1, y + 1, 1}};
  }
  return boxes;
}

// Cells, on the only tree, of boxes from both ends of the scene.
std::size_t wideCells(const CellTrees<float>& trees, float width) {
  std::size_t wide = 0;
  for (std::size_t cell = 0; cell < trees.cells(0); ++cell) {
    const Group<float>& bounds = trees.views()[0].levels[1][cell / group_size];
    wide += bounds.upper[0][cell % group_size] - bounds.lower[0][cell % group_size] > width;
  }
  return wide;
}

}  // namespace

TEST_CASE("A box that moves a little stays in its cell, and is found where it is") {
  const ScopedMode mode(exactMode());
  const BoxSet boxes = layerOfBoxes(400, 20);
  CellTrees<float> tree;
  tree.build(boxes, 1);
  std::vector<Slot> found(tree.most());
  for (Slot slot = 0; slot < boxes.size; ++slot) {
    Box box = boxes.boxes[slot];
    box.lower[2] += 1.5f;
    box.upper[2] += 1.5f;
    tree.place(slot, box);
    const Box above = {{box.lower[0] + 0.25f, box.lower[1] + 0.25f, 2},
                       {box.lower[0] + 0.5f, box.lower[1] + 0.5f, 3}};
    REQUIRE(tree.find(above, found.data()) == 1);
    CHECK(found[0] / 2 == slot);
  }
  CHECK(tree.strayRows() == 0);
}

TEST_CASE("Wherever cells grow, all are cut anew") {
  constexpr Slot all = 128 * 1024;
  constexpr float far = 1e6f;
  for (const std::size_t node : {1, 2, 255, 400}) {
    BoxSet boxes = layerOfBoxes(all);
    Sweep<float> sweep;
    Buffer<std::uint64_t> workspace;
    sweep.build(boxes, 1, workspace);
    const TreeView<float>& tree = sweep.trees().views()[0];
    REQUIRE(tree.groups[1] > 401);
    // Half the boxes of the node's cells fly to one place, where kept cells would all reach.
    for (std::size_t cell = node * group_size; cell < (node + 1) * group_size; ++cell)
      for (int lane = 0; lane < group_size; lane += 2)
        for (float* const x : {boxes.boxes[tree.levels[0][cell].slot[lane]].lower,
                               boxes.boxes[tree.levels[0][cell].slot[lane]].upper})
          x[0] += far;
    sweep.build(boxes, 1, workspace);
    INFO("node " << node);
    REQUIRE(wideCells(sweep.trees(), far / 2) < group_size / 2);
  }
}

namespace {

// Cubes of these sizes in turn, far apart.
template <class Real>
BoxSet boxesOfSizes(const std::vector<std::array<double, 3>>& sizes, std::size_t count) {
  BoxSet boxes;
  boxes.size = count;
  boxes.wide = sizeof(Real) > sizeof(float);
  boxBufferOf<Real>(boxes).resize(count);
  for (std::size_t slot = 0; slot < count; ++slot) {
    BasicBox<Real>& box = boxBufferOf<Real>(boxes)[slot];
    for (int axis = 0; axis < 3; ++axis) {
      box.lower[axis] = static_cast<Real>(slot);
      box.upper[axis] = static_cast<Real>(slot + sizes[slot % sizes.size()][axis]);
    }
  }
  return boxes;
}

template <class Real>
void checkSizes(const std::vector<std::array<double, 3>>& sizes, std::size_t wanted) {
  const BoxSet boxes = boxesOfSizes<Real>(sizes, 3000);
  BoxClasses<Real> classes;
  classes.choose(boxes);
  std::set<std::size_t> used;
  for (Slot slot = 0; slot < boxes.size; ++slot) {
    used.insert(classes.of(boxesOf<Real>(boxes)[slot]));
    REQUIRE(*used.rbegin() < classes.count());
  }
  REQUIRE(used.size() == wanted);
  for (Slot slot = 0; slot < boxes.size && wanted == sizes.size(); ++slot)
    REQUIRE(classes.of(boxesOf<Real>(boxes)[slot]) ==
            classes.of(boxesOf<Real>(boxes)[slot % sizes.size()]));
}

}  // namespace

TEST_CASE("Boxes that are far longer on an axis are a class", "[classes]") {
  checkSizes<float>({{1, 1, 1}, {2, 1, 3}}, 1);
  checkSizes<float>({{1, 1, 1}, {1, 1, 1}, {40, 1, 1}}, 2);
  checkSizes<float>({{20, 1, 1}, {1, 20, 1}, {1, 1, 20}}, 3);
  checkSizes<double>({{1e-9, 1e-9, 1e-9}, {1e9, 1e9, 1e9}}, 2);
  checkSizes<double>({{1, 1, 1}, {HUGE_VAL, 1, 1}}, 2);
  checkSizes<float>({{1, 1, 1}, {40, 40, 40}, {HUGE_VAL, 1, 1}}, 3);
  checkSizes<float>({{0, 0, 0}, {0, 0, 0}}, 1);
}

TEST_CASE("Boxes are no class that are shorter than a cell of all would be", "[classes]") {
  checkSizes<float>({{0.01, 0.01, 0.01}, {1, 1, 1}}, 1);
  checkSizes<float>({{1, 1, 1}, {HUGE_VAL, 1, 1}, {0.01, 0.01, 0.01}}, 2);
  checkSizes<double>({{0.01, 0.01, 0.01}, {100, 1, 1}}, 2);
}

TEST_CASE("Bars stay a class where a few boxes are far away", "[classes]") {
  BoxSet boxes = boxesOfSizes<float>({{1, 1, 1}, {1, 1, 1}, {40, 1, 1}}, 3000);
  for (Slot slot = 0; slot < boxes.size; slot += 20)
    for (float* const bounds : {boxes.boxes[slot].lower, boxes.boxes[slot].upper})
      bounds[1] += 1e6f;
  BoxClasses<float> classes;
  classes.choose(boxes);
  CHECK(classes.of(boxes.boxes[1]) != classes.of(boxes.boxes[2]));
}

TEST_CASE("Each cell has boxes of one class", "[classes]") {
  const BoxSet boxes = boxesOfSizes<float>({{1, 1, 1}, {40, 1, 1}}, 600);
  CellOrder<float> order;
  Buffer<std::uint64_t> workspace;
  order.build(boxes, 1, workspace);
  const CellBoxes of = order.boxesOfCells();
  REQUIRE(order.classEnds().size() > 1);
  const std::size_t cells = order.classEnds().back();
  for (std::size_t cell = 0; cell < cells; ++cell)
    for (std::uint32_t i = of.starts[cell]; i < of.starts[cell + 1]; ++i)
      CHECK(of.order[i] % 2 == of.order[of.starts[cell]] % 2);
  CHECK(cells > 600 / 16);
}

namespace {

// Of any bits, or of a box of that size and some other bounds.
void drawBounds(sap_test::Random& random, double size, double (&bounds)[6]) {
  const double special[] = {0.0,       -0.0,     NAN,        HUGE_VAL,
                            -HUGE_VAL, 1e-310,   -1e-310,    1e-45,
                            3.5e38,    1e300,    1.0,        -1.0,
                            1.7e308,   -1.7e308, 16777217.0, std::numeric_limits<float>::max()};
  const auto anySpecial = [&] { return special[random.below(std::size(special))]; };
  const bool of_any_bits = random.chance(0.5);
  for (int i = 0; i < 6; ++i) {
    const std::uint64_t bits = random.bits();
    if (!of_any_bits)
      bounds[i] = i % 2 ? bounds[i - 1] + size * random.between(0, 1)
                        : size * random.gauss() * std::pow(10, random.between(0, 12));
    else if (random.chance(0.75))
      bounds[i] = anySpecial();
    else
      std::memcpy(&bounds[i], &bits, sizeof bits);
  }
  if (of_any_bits) return;
  if (random.chance(0.3))
    for (double& bound : bounds) bound = static_cast<float>(bound);
  if (random.chance(0.2)) bounds[random.below(6)] = anySpecial();
  if (random.chance(0.1)) std::swap(bounds[0], bounds[1]);
}

}  // namespace

TEST_CASE(
    "Bounds become the nearest floats that are finite, and in vectors what they become alone") {
  sap_test::Random random(sap_test::seedOr(1));
  constexpr float most = std::numeric_limits<float>::max();
  int fine_boxes = 0;
  for (int round = 0; round < sap_test::scaled(500000); ++round) {
    const double size = std::pow(10, random.between(-60, 60));
    double bounds[6];
    drawBounds(random, size, bounds);
    CAPTURE(bounds[0], bounds[1], bounds[2], bounds[3], bounds[4], bounds[5]);
    Box box, wanted;
    const BoundsFacts facts = roundToFloats<double>(bounds, box);
    const BoundsFacts truth = roundToFloatsOneByOne<double>(bounds, wanted);
    bool has_nan = false, nearest = true, exact = true;
    float farthest = 0;
    for (int i = 0; i < 6; ++i) {
      const float bound = (i % 2 ? wanted.upper : wanted.lower)[i / 2];
      has_nan = has_nan || std::isnan(bounds[i]);
      nearest = nearest && bound == std::clamp(static_cast<float>(bounds[i]), -most, most);
      exact = exact && (std::isinf(bounds[i]) || (bound == bounds[i] && std::fabs(bound) < most));
      farthest = std::max(farthest, std::fabs(bound));
    }
    REQUIRE(!(facts & nan_bounds) == !has_nan);
    REQUIRE(!(truth & nan_bounds) == !has_nan);
    if (has_nan) continue;  // the box is of no use
    REQUIRE(nearest);
    REQUIRE(!(truth & inexact_bounds) == exact);
    REQUIRE(facts == truth);
    REQUIRE(std::memcmp(&box, &wanted, sizeof box) == 0);
    const float limit = random.chance(0.5) ? most : static_cast<float>(size * random.between(0, 4));
    Box fine_box = {};
    bool still_exact = true;
    const bool fine = roundFine(bounds, limit * coarse_share, fine_box, still_exact);
    fine_boxes += fine;
    REQUIRE(still_exact == !(fine && truth & inexact_bounds));
    if (!fine) continue;
    REQUIRE(!(truth & ~inexact_bounds));
    REQUIRE(std::memcmp(&fine_box, &wanted, sizeof box) == 0);
    REQUIRE(farthest < limit);
  }
  CHECK(fine_boxes > 0);
}

TEST_CASE("Threads that take from one another's parts take every index once") {
  static Region region("parts");
  std::vector<std::atomic<int>> taken(100003);
  for (const int threads : {1, 2, 7, 16}) {
    for (auto& times : taken) times = 0;
    const auto take = [&](Range range, int thread) {
      if (thread == 0) std::this_thread::yield();
      for (std::size_t i = range.begin; i < range.end; ++i) ++taken[i];
    };
    runChunks(region, threads, taken.size(), 3, take, threads);
    CHECK(std::all_of(taken.begin(), taken.end(), [](const auto& times) { return times == 1; }));
  }
}

TEST_CASE("An exception of any thread reaches the caller, once all are done") {
  static Region region("exceptions");
  for (const int threads : {1, 4})
    REQUIRE_THROWS_AS(runTeam(region, threads, [](int, int) { throw std::bad_alloc(); }),
                      std::bad_alloc);
}

TEST_CASE("An exception of the program is thrown rather than a lack of memory") {
  static Region region("two exceptions");
  std::atomic<bool> lacking{false};
  const bool are_two = threadsToBeHad(2) > 1;
  const auto work = [&](int thread, int) {
    if (thread > 0) {
      lacking = true;
      throw std::bad_alloc();
    }
    while (are_two && !lacking) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    throw 1;
  };
  REQUIRE_THROWS_AS(runTeam(region, 2, work), int);
}
