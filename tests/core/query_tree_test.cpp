// The tree behind dSpaceCollide2, with every instruction set this processor has.
#include "space/queries/query_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "space/simd/kernels.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"
#include "support/scenes.h"

using namespace ode_parallel_sap;

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
constexpr BasicBox<Real> none = {{NAN, NAN, NAN}, {NAN, NAN, NAN}};

// What the tree finds is what overlaps, and is marked where only exact bounds can tell.
template <class Real>
void checkQuery(QueryTree<Real>& tree, const std::vector<BasicBox<Real>>& boxes,
                const BasicBox<Real>& query) {
  std::vector<Slot> wanted;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    if (overlapShrunk(query, boxes[i], 0)) wanted.push_back(static_cast<Slot>(i));
  std::vector<Slot> got(boxes.size() + tree.spare);
  got.resize(tree.find(query, got.data()));
  for (Slot& slot : got) {
    const bool borderline = slot & borderline_slot;
    slot &= ~borderline_slot;
    REQUIRE(slot < boxes.size());
    if (borderline)
      REQUIRE(!overlapShrunk(query, boxes[slot], 2));
    else
      REQUIRE(overlapShrunk(query, boxes[slot], 1));
  }
  std::sort(got.begin(), got.end());
  REQUIRE(got == wanted);
}

// Some tremble, some are flung away, go or come back; beyond the slots it was built with, too.
template <class Real>
void changeSome(QueryTree<Real>& tree, std::vector<BasicBox<Real>>& boxes,
                sap_test::Random& random) {
  for (int change = 0; change < 12; ++change) {
    const std::size_t i = random.below(boxes.size());
    const Real by = static_cast<Real>(random.gauss() * (random.chance(0.5) ? 0.01 : 10));
    if (random.chance(0.2))
      boxes[i] = none<Real>;
    else if (!isActive(boxes[i]))
      boxes[i] = {{by, by, by}, {by + 1, by + 1, by + 1}};
    else
      for (int axis = 0; axis < 3; ++axis) {
        boxes[i].lower[axis] += by;
        boxes[i].upper[axis] += by;
      }
    const bool fits = tree.fits(static_cast<Slot>(i), boxes[i]);
    const std::size_t rows = tree.strayRows();
    tree.place(static_cast<Slot>(i), boxes[i]);
    if (fits) REQUIRE(tree.strayRows() == rows);
  }
}

template <class Real>
void checkQueryTree(const sap_test::BoxScene& scene, std::uint64_t seed) {
  sap_test::Random random(seed);
  const std::vector<sap_test::Box> all = scene.make(701, seed);
  BoxSet set;
  set.size = all.size();
  set.wide = sizeof(Real) > sizeof(float);
  set.boxes.resize(all.size());
  set.wide_boxes.resize(all.size());
  std::vector<BasicBox<Real>> boxes(all.size() + 20, none<Real>);
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      boxes[i].lower[axis] = static_cast<Real>(all[i].low[axis]);
      boxes[i].upper[axis] = static_cast<Real>(all[i].high[axis]);
    }
    if (random.chance(0.02)) boxes[i] = none<Real>;
    if constexpr (sizeof(Real) > sizeof(float))
      set.wide_boxes[i] = boxes[i];
    else
      set.boxes[i] = boxes[i];
  }
  QueryTree<Real> tree;
  tree.build(set, 2);
  REQUIRE(tree.strayRows() == 0);
  for (int round = 0; round < 60; ++round) {
    checkQuery(tree, boxes, boxes[random.below(boxes.size())]);
    changeSome(tree, boxes, random);
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
