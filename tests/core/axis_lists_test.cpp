// The lists of the method AxisLists, as plain arrays, cut into parts.
#include "space/paper/axis_lists.h"

#include <cmath>
#include <limits>

#include "cuda/axis_lists/axis_parts.h"
#include "support/case.h"

using namespace ode_parallel_sap;

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
    AxisRows rows[3];
    sortAxes(wanted.boxes, 1, rows);
    const AxisChoice axes = chooseAxes(rows);
    AxisPart part;  // one for all: what it held before must not matter
    for (const int parts : {1, 2, 3, 4, 7, 64}) {
      CAPTURE(scene.name, parts);
      std::vector<Pair> all;
      std::uint64_t covered = 0;
      for (int i = 0; i < parts; ++i) {
        part.cut(rows, axes, i, parts);
        const std::uint64_t size = part.end() - part.begin();
        REQUIRE(size - rows[axes.fullest].pairs() / parts <= 1);
        REQUIRE(part.end() <= part.rows(axes.fullest).pairs());
        covered += size;
        const std::vector<Pair> found = pairsOf(part, axes);
        all.insert(all.end(), found.begin(), found.end());
      }
      REQUIRE(covered == rows[axes.fullest].pairs());
      std::sort(all.begin(), all.end());
      REQUIRE(all == wanted.exact);
    }
  }
}
