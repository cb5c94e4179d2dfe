// When boxes are divided by their filter bits.
#include "space/cells/filter_groups.h"

#include <vector>

#include "space/cells/cell_order.h"
#include "support/case.h"
#include "support/catch.hpp"
#include "support/scenes.h"

using namespace ode_parallel_sap;

namespace {

BoxSet boxesOfKinds(const std::vector<FilterBits>& kinds) {
  BoxSet boxes = makeCase(sap_test::denseCube(600, 1), false, false).boxes;
  boxes.filter_bits = true;
  boxes.bits.resize(boxes.size);
  for (std::size_t slot = 0; slot < boxes.size; ++slot)
    boxes.bits[slot] = kinds[slot % kinds.size()];
  return boxes;
}

std::size_t groupsOf(const std::vector<FilterBits>& kinds) {
  const BoxSet boxes = boxesOfKinds(kinds);
  FilterGroups groups;
  for (const int threads : {1, 3}) {
    groups.choose<float>(boxes, threads);
    REQUIRE((groups.ofSlots() != nullptr) == (groups.count() > 1));
    if (!groups.ofSlots()) continue;
    for (std::size_t slot = 0; slot < boxes.size; ++slot)
      REQUIRE(groups.ofSlots()[slot] == slot % kinds.size());
  }
  return groups.count();
}

}  // namespace

TEST_CASE("Few kinds of bits of which many do not meet are groups", "[groups]") {
  CHECK(groupsOf({{1, 2}, {2, 1}}) == 2);
  CHECK(groupsOf({{1, 0}, {2, 2}}) == 2);
  CHECK(groupsOf({{1, 2}, {2, 4}, {4, 8}}) == 3);
  CHECK(groupsOf({{1, 2}, {2, 4}, {4, 8}, {8, 8}}) == 4);
}

TEST_CASE("Other boxes are one group", "[groups]") {
  CHECK(groupsOf({{1, 1}}) == 1);
  CHECK(groupsOf({{1, 3}, {2, 3}}) == 1);                                  // all meet
  CHECK(groupsOf({{1, 1}, {1, 1}, {1, 1}, {1, 1}, {1, 1}, {2, 1}}) == 1);  // nearly all
  CHECK(groupsOf({{1, 2}, {2, 4}, {4, 8}, {8, 16}, {16, 32}}) == 1);       // too many kinds
}

TEST_CASE("Each cell has boxes of one group", "[groups]") {
  const BoxSet boxes = boxesOfKinds({{1, 2}, {2, 1}});
  CellOrder<float> order;
  Buffer<std::uint64_t> workspace;
  order.build(boxes, 1, workspace);
  const CellBoxes of = order.boxesOfCells();
  const CellClasses classes = order.classes();
  REQUIRE(classes.count > 1);
  const std::size_t cells = classes.first[classes.count - 1].last_cell;
  for (std::size_t cell = 0; cell < cells; ++cell)
    for (std::uint32_t i = of.starts[cell]; i < of.starts[cell + 1]; ++i)
      CHECK(of.order[i] % 2 == of.order[of.starts[cell]] % 2);
  CHECK(cells > 600 / 16);
}
