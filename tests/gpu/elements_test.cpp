// What kernels do with one bound, box, pair or place, compiled for the host: held against the CPU's
// rules and against counting by hand, without a device.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "cuda/one/cell_cut.h"
#include "cuda/one/curve.h"
#include "cuda/one/elements.h"
#include "space/base/pair_list.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"

using namespace ode_parallel_sap;
using sap_test::Random;

namespace {

// Any float at all, or one beside a few that things change at.
float anyFloat(Random& random) {
  const float inf = std::numeric_limits<float>::infinity();
  const float special[] = {0.0f, -0.0f,   1e-45f, -1e-45f, 1.17549435e-38f, 1, -1,
                           3,    3.4e38f, inf,    -inf};
  if (random.chance(0.3)) return floatOf(static_cast<std::int32_t>(random.bits()));
  const float near = special[random.below(sizeof special / sizeof *special)];
  const auto steps = static_cast<int>(random.below(9)) - 4;
  const float moved = unordered(ordered(near) + steps);
  return std::isinf(near) || std::isnan(moved) ? near : moved;
}

device::Record recordOf(const Box& box) {
  return {{box.lower[0], box.lower[1], box.lower[2], 0},
          {box.upper[0], box.upper[1], box.upper[2], 0}};
}

// As boxes come to a device: none of their bounds is infinite.
Box bounded(Box box) {
  for (int axis = 0; axis < 3; ++axis)
    for (float* const bound : {&box.lower[axis], &box.upper[axis]})
      *bound = std::max(-std::numeric_limits<float>::max(),
                        std::min(*bound, std::numeric_limits<float>::max()));
  return box;
}

Box anyBox(Random& random) {
  Box box;
  const bool ordinary = random.chance(0.4);
  for (int axis = 0; axis < 3; ++axis) {
    if (ordinary) {
      box.lower[axis] = static_cast<float>(random.between(-1, 1));
      box.upper[axis] = box.lower[axis] + static_cast<float>(std::exp2(random.between(-24, 1)));
      continue;
    }
    box.lower[axis] = anyFloat(random);
    box.upper[axis] = anyFloat(random);
    if (random.chance(0.7) && box.upper[axis] < box.lower[axis])
      std::swap(box.upper[axis], box.lower[axis]);
  }
  return box;
}

// Its bounds are a few steps from the other box's.
Box boxBeside(const Box& other, Random& random) {
  const auto near = [&](float bound) {
    if (!std::isfinite(bound)) return bound;
    const float moved = unordered(ordered(bound) + static_cast<int>(random.below(9)) - 4);
    return std::isfinite(moved) ? moved : bound;
  };
  Box box = anyBox(random);
  if (random.chance(0.4)) return box;
  for (int axis = 0; axis < 3; ++axis) {
    if (random.chance(0.5)) box.lower[axis] = near(other.upper[axis]);
    if (random.chance(0.5)) box.upper[axis] = near(other.lower[axis]);
    if (random.chance(0.3)) box.lower[axis] = near(other.lower[axis]);
  }
  return box;
}

bool overlapByFormula(const Box& a, const Box& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(a.lower[axis] <= b.upper[axis] && b.lower[axis] <= a.upper[axis])) return false;
  return true;
}

// How many of all keys share the digits from `shift` on with this one.
template <class Key>
std::size_t alike(const std::vector<Key>& keys, Key key, int shift) {
  return static_cast<std::size_t>(std::count_if(
      keys.begin(), keys.end(), [&](Key other) { return other >> shift == key >> shift; }));
}

// Returns whether more boxes have one key than a search can bear.
template <class Key>
bool checkCuts(std::vector<Key> keys) {
  constexpr int class_shift = sizeof(Key) * 8 - device::class_digits;
  std::sort(keys.begin(), keys.end());
  std::size_t begin = 0, equal_from = 0;
  bool clustered = false, cluster = false;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const device::CellCut cut = device::cellCutAt(keys.data(), keys.size(), i);
    clustered = clustered || cut.cluster;
    if (i == 0) {
      REQUIRE(cut.begins);
      continue;
    }
    if (keys[i] != keys[i - 1]) equal_from = i;
    cluster = cluster || i - equal_from == device::cluster_size;
    const Key differ = keys[i] ^ keys[i - 1];
    bool expected;
    if (differ >> class_shift)
      expected = true;
    else if (differ)
      expected = alike(keys, keys[i], device::highestDigit(differ) + 1) > device::cell_size;
    else
      expected =
          alike(keys, keys[i], 0) > device::cell_size && (i - equal_from) % device::cell_size == 0;
    REQUIRE(cut.begins == expected);
    if (cut.begins) {
      REQUIRE(i - begin <= device::cell_size);
      begin = i;
    }
  }
  REQUIRE(keys.size() - begin <= device::cell_size);
  REQUIRE(clustered == cluster);
  return cluster;
}

}  // namespace

TEST_CASE("Integers stand for floats in their order, and come back as the same bits",
          "[elements]") {
  Random random(sap_test::seedOr(91));
  for (int i = 0; i < 200000; ++i) {
    const float a = anyFloat(random), b = anyFloat(random);
    REQUIRE(bitsOf(unordered(ordered(a))) == bitsOf(a));
    if (std::isnan(a) || std::isnan(b)) continue;
    if (a < b) REQUIRE(ordered(a) < ordered(b));
  }
}

TEST_CASE("A device takes boxes to overlap, and pairs for borderline, as the CPU does",
          "[elements]") {
  Random random(sap_test::seedOr(92));
  int overlapping = 0, borderline = 0;
  for (int i = 0; i < 200000; ++i) {
    const Box a = bounded(anyBox(random));
    const Box b = bounded(random.chance(0.8) ? boxBeside(a, random) : anyBox(random));
    const device::Record of_a = recordOf(a), of_b = recordOf(b);
    const bool found = device::overlap(of_a.low, of_a.high, of_b.low, of_b.high);
    REQUIRE(found == overlapByFormula(a, b));
    if (!device::isActive(of_a) || !device::isActive(of_b)) continue;
    const float depth = device::depthOf(of_a.low, of_a.high, of_b.low, of_b.high);
    REQUIRE((depth >= 0) == found);
    if (found) REQUIRE((depth == 0) == isBorderline(a, b));
    overlapping += found;
    borderline += depth == 0;
  }
  CHECK(overlapping > 1000);
  CHECK(borderline > 100);
}

TEST_CASE("Whatever overlaps may overlap in nine bits, whatever they are scaled by", "[elements]") {
  Random random(sap_test::seedOr(98));
  std::size_t overlapping = 0;
  for (int trial = 0; trial < 1000000; ++trial) {
    const Box scaled_by = anyBox(random), one = anyBox(random);
    const Box other = random.chance(0.8) ? boxBeside(one, random) : anyBox(random);
    const device::Record bounds = recordOf(scaled_by), a = recordOf(one), b = recordOf(other);
    if (!device::isActive(bounds) || !device::isActive(a) || !device::isActive(b)) continue;
    if (!device::overlap(a.low, a.high, b.low, b.high)) continue;
    ++overlapping;
    const device::CoarseScale scale(bounds.low, bounds.high);
    if (!mayOverlap(scale.coarse(a.low, a.high), scale.coarse(b.low, b.high)))
      FAIL("boxes that overlap may not, in trial " << trial);
  }
  CHECK(overlapping > 10000);
}

TEST_CASE("Cells are whole blocks of space, of 32 boxes at most, or a cluster", "[elements]") {
  Random random(sap_test::seedOr(97));
  for (const std::size_t count : {1024, 1025, 5000})
    CHECK(checkCuts(std::vector<std::uint32_t>(count, 7)) == (count > device::cluster_size));
  for (int round = 0; round < 60; ++round) {
    INFO("round " << round);
    const std::size_t count = 1 + random.below(round % 10 == 0 ? 2500 : 600);
    // Few keys that differ anywhere, or many in one place.
    const int digits = 1 + static_cast<int>(random.below(32));
    const double clustered = random.chance(0.3) ? random.unit() : 0;
    std::vector<std::uint32_t> keys;
    std::vector<std::uint64_t> long_keys;
    const std::uint32_t place = static_cast<std::uint32_t>(random.bits());
    for (std::size_t i = 0; i < count; ++i) {
      const auto any = static_cast<std::uint32_t>(random.bits() >> 32);
      keys.push_back(random.chance(clustered) ? place : any >> (32 - digits) << random.below(2));
      long_keys.push_back(std::uint64_t{keys.back()} << 32 | (random.chance(0.5) ? any & 3 : 0));
    }
    checkCuts(keys);
    checkCuts(long_keys);
  }
}
