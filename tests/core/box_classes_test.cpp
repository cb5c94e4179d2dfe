// Which boxes are divided by their sizes and shapes.

#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "space/pairs/cell_order.h"
#include "support/catch.hpp"

using namespace ode_parallel_sap;

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
