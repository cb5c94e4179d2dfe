// Boxes that move in a kept tree: which stay in their cells.
#include "space/pairs/cell_trees.h"

#include <algorithm>
#include <vector>

#include "space/base/floating_point.h"
#include "support/catch.hpp"

using namespace ode_parallel_sap;

namespace {

constexpr Slot row_length = 20;

Box boxOf(Slot slot) {
  const float x = static_cast<float>(slot % row_length), y = static_cast<float>(slot / row_length);
  return {{x, y, 0}, {x + 1, y + 1, 1}};
}

// Unit boxes side by side.
CellTrees<float> treeOfRows() {
  BoxSet boxes;
  boxes.size = row_length * row_length;
  boxes.boxes.resize(boxes.size);
  for (Slot slot = 0; slot < boxes.size; ++slot) boxes.boxes[slot] = boxOf(slot);
  CellTrees<float> tree;
  tree.build(boxes, 1);
  return tree;
}

std::vector<Slot> found(const CellTrees<float>& tree, const Box& box) {
  std::vector<Slot> slots(tree.most());
  slots.resize(tree.find(box, slots.data()));
  for (Slot& slot : slots) slot /= 2;
  std::sort(slots.begin(), slots.end());
  return slots;
}

}  // namespace

TEST_CASE("A box that moves a little stays in its cell, and is found where it is", "[queries]") {
  const ScopedMode mode(exactMode());
  CellTrees<float> tree = treeOfRows();
  for (Slot slot = 0; slot < row_length * row_length; ++slot) {
    Box box = boxOf(slot);
    box.lower[2] += 1.5f;
    box.upper[2] += 1.5f;
    tree.place(slot, box);
    const Box above = {{box.lower[0] + 0.25f, box.lower[1] + 0.25f, 2},
                       {box.lower[0] + 0.5f, box.lower[1] + 0.5f, 3}};
    CHECK(found(tree, above) == std::vector<Slot>{slot});
  }
  CHECK(tree.strayRows() == 0);
}
