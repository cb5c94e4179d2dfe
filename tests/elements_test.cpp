// What kernels do with one bound, box, pair or place, compiled for the host: held against the CPU's
// rules and against counting by hand, without a device.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "cuda/one/cell_cut.h"
#include "cuda/one/cell_dealer.h"
#include "cuda/one/curve.h"
#include "cuda/one/elements.h"
#include "cuda/one/row_length.h"
#include "cuda/one/size_rules.h"
#include "space/data/packed_pair_rule.h"
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
  device::Record record = {{box.lower[0], box.lower[1], box.lower[2], 0},
                           {box.upper[0], box.upper[1], box.upper[2], 0}};
  record.high.w = device::magnitudeOf(record.low, record.high);
  return record;
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

}  // namespace

TEST_CASE("Integers stand for floats in their order, and come back as the same bits",
          "[elements]") {
  Random random(sap_test::seedOr(91));
  for (int i = 0; i < 200000; ++i) {
    const float a = anyFloat(random), b = anyFloat(random);
    REQUIRE(bitsOf(unordered(ordered(a))) == bitsOf(a));
    if (std::isnan(a) || std::isnan(b)) continue;
    if (a < b) {
      REQUIRE(ordered(a) < ordered(b));
      REQUIRE(stepNumber(a) < stepNumber(b));
      const std::int64_t steps = std::int64_t{stepNumber(b)} - stepNumber(a);
      REQUIRE((steps == 1) == (std::nextafter(a, b) == b));
    }
    if (a == b) REQUIRE(stepNumber(a) == stepNumber(b));
  }
}

TEST_CASE("A device takes boxes to overlap, and pairs for borderline, as the CPU does",
          "[elements]") {
  Random random(sap_test::seedOr(92));
  int overlapping = 0, borderline = 0, clear = 0;
  for (int i = 0; i < 200000; ++i) {
    const Box a = anyBox(random), b = random.chance(0.8) ? boxBeside(a, random) : anyBox(random);
    const device::Record of_a = recordOf(a), of_b = recordOf(b);
    const bool found = device::overlap(of_a.low, of_a.high, of_b.low, of_b.high);
    REQUIRE(found == overlapByFormula(a, b));
    if (!found) continue;
    ++overlapping;
    const bool is_borderline =
        device::overlapIsBorderline(of_a.low, of_a.high, of_b.low, of_b.high);
    REQUIRE(is_borderline == isBorderline(a, b));
    borderline += is_borderline;
    // The quick answer may be "ask", but never wrong.
    if (!device::isClear(of_a.low, of_a.high, of_b.low, of_b.high)) continue;
    ++clear;
    REQUIRE(!is_borderline);
  }
  CHECK(overlapping > 1000);
  CHECK(borderline > 100);
  CHECK(clear > 100);
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

TEST_CASE("Nine bits tell most boxes of a cell apart", "[elements]") {
  Random random(sap_test::seedOr(99));
  const device::Record bounds = {{1000, -4, 0, 0}, {1004, 0, 4e-3f, 0}};
  const device::CoarseScale scale(bounds.low, bounds.high);
  const auto boxIn = [&] {
    const auto part = [&](float low, float high, float& lower, float& upper) {
      const float extent = (high - low) / 4;
      lower = low + (high - low - extent) * static_cast<float>(random.between(0, 1));
      upper = lower + extent;
    };
    device::Record box = {};
    part(bounds.low.x, bounds.high.x, box.low.x, box.high.x);
    part(bounds.low.y, bounds.high.y, box.low.y, box.high.y);
    part(bounds.low.z, bounds.high.z, box.low.z, box.high.z);
    return box;
  };
  int overlapping = 0, possible = 0;
  for (int trial = 0; trial < 100000; ++trial) {
    const device::Record a = boxIn(), b = boxIn();
    overlapping += device::overlap(a.low, a.high, b.low, b.high);
    possible += mayOverlap(scale.coarse(a.low, a.high), scale.coarse(b.low, b.high));
  }
  CHECK(overlapping > 10000);
  CHECK(possible < 1.03 * overlapping);
}

TEST_CASE("An octave is the exponent of an extent, and that of infinity the last", "[elements]") {
  Random random(sap_test::seedOr(94));
  for (int i = 0; i < 20000; ++i) {
    const float extent = std::fabs(anyFloat(random));
    const int octave = size_rules::octaveOf(extent);
    if (!std::isfinite(extent))
      REQUIRE(octave == size_rules::unbounded_octave);
    else
      REQUIRE(octave == (extent < 1.17549435e-38f ? 0 : std::ilogb(extent) + 127));
    if (extent > 0 && std::isfinite(extent)) REQUIRE(size_rules::octaveOf(-extent) == 0);
  }
}

namespace {

// Boxes around centres, and the curve through them, as the stage of the keys makes it.
struct CurvedBoxes {
  std::vector<device::Record> boxes;
  device::Curve curve;
  float low[3], high[3];  // of the centres
  double sum[3] = {};     // of the extents

  CurvedBoxes(std::size_t count, const double (&range)[3], const double (&size)[3], int digits,
              Random& random) {
    int least[3], greatest[3];
    unsigned long long extent[3] = {};
    const double largest = std::max({size[0], size[1], size[2]});
    for (int axis = 0; axis < 3; ++axis) {
      least[axis] = std::numeric_limits<int>::max();
      greatest[axis] = std::numeric_limits<int>::min();
    }
    for (std::size_t i = 0; i < count; ++i) {
      Box box;
      for (int axis = 0; axis < 3; ++axis) {
        const double centre = range[axis] * random.between(-1, 1);
        box.lower[axis] = static_cast<float>(centre - size[axis] / 2);
        box.upper[axis] = static_cast<float>(centre + size[axis] / 2);
        const float middle = device::centreOf(box.lower[axis], box.upper[axis]);
        least[axis] = std::min(least[axis], ordered(middle));
        greatest[axis] = std::max(greatest[axis], ordered(middle));
        extent[axis] +=
            largest > 0 ? static_cast<unsigned long long>(size[axis] / largest * 65536) : 0;
      }
      boxes.push_back(recordOf(box));
    }
    curve.choose(least, greatest, extent, digits);
    for (int axis = 0; axis < 3; ++axis) curve.chooseSpread(axis, digits);
    std::copy(extent, extent + 3, sum);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = unordered(least[axis]);
      high[axis] = unordered(greatest[axis]);
    }
  }
  // No step of the curve's that could have been longer is shorter than half another one, in terms
  // of the boxes' mean extents there.
  bool alikeSteps() const {
    double step[3], longest = 0;
    const double greatest = std::max({sum[0], sum[1], sum[2]});
    for (int axis = 0; axis < 3; ++axis) {
      step[axis] = std::ldexp(static_cast<double>(high[axis]) - low[axis], -curve.bits[axis]) /
                   std::max(sum[axis], greatest / 1024);
      longest = std::max(longest, step[axis]);
    }
    for (int axis = 0; axis < 3; ++axis)
      if (curve.bits[axis] > 0 && step[axis] < 0.499 * longest) return false;
    return true;
  }
  static float centre(const device::Record& box, int axis) {
    return axis == 0   ? device::centreOf(box.low.x, box.high.x)
           : axis == 1 ? device::centreOf(box.low.y, box.high.y)
                       : device::centreOf(box.low.z, box.high.z);
  }
};

}  // namespace

TEST_CASE("A place on the curve is a block of space, smaller with each digit", "[elements]") {
  Random random(sap_test::seedOr(95));
  const double ranges[][3] = {{10, 10, 10}, {1000, 1000, 1},       {1e6, 1, 1},
                              {0, 5, 5},    {1e-39, 1e-39, 1e-39}, {1e30, 1e15, 1}};
  for (const double(&range)[3] : ranges)
    for (const double thin : {1.0, 0.01, 0.0})
      for (const int digits :
           {device::short_key_digits - device::class_digits, device::curve_digits}) {
        const double least = std::min({range[0] > 0 ? range[0] : 1e300, range[1], range[2]});
        const double size[3] = {least / 10, least / 10 * thin, least / 10};
        const CurvedBoxes scene(300, range, size, digits, random);
        INFO("range " << range[0] << " " << range[1] << " " << range[2] << ", thin " << thin << ", "
                      << digits << " digits");
        REQUIRE(scene.curve.bits[0] + scene.curve.bits[1] + scene.curve.bits[2] == digits);
        REQUIRE(scene.alikeSteps());
        std::vector<std::uint32_t> keys;
        for (const device::Record& box : scene.boxes) keys.push_back(scene.curve.keyOf(box));
        for (const std::uint32_t key : keys) REQUIRE(key < 1u << digits);
        for (std::size_t i = 1; i < keys.size(); ++i) {
          // What two keys share says how near their boxes are on each axis.
          const int differ =
              keys[i] == keys[i - 1] ? 0 : device::highestDigit(keys[i] ^ keys[i - 1]) + 1;
          int shared[3] = {};
          for (int digit = digits - 1; digit >= differ; --digit)
            ++shared[scene.curve.axes >> 2 * digit & 3];
          for (int axis = 0; axis < 3; ++axis) {
            const double all = static_cast<double>(scene.high[axis]) - scene.low[axis];
            const double apart =
                std::fabs(static_cast<double>(CurvedBoxes::centre(scene.boxes[i], axis)) -
                          CurvedBoxes::centre(scene.boxes[i - 1], axis));
            // Places are computed in floats.
            REQUIRE(apart <= all * (std::ldexp(1.0, -shared[axis]) + 1e-6));
          }
        }
      }
}

TEST_CASE("Digits are spread to those of any mask, in their order", "[elements]") {
  Random random(sap_test::seedOr(101));
  for (int trial = 0; trial < 100000; ++trial) {
    std::uint32_t mask = 0;
    const double full = random.unit();
    for (int digit = 0; digit < 32; ++digit)
      if (random.chance(full)) mask |= 1u << digit;
    const auto number = static_cast<std::uint32_t>(random.unit() * 4294967296.0);
    std::uint32_t expected = 0, left = number;
    for (int digit = 0; digit < 32; ++digit) {
      if (!(mask >> digit & 1)) continue;
      expected |= (left & 1) << digit;
      left >>= 1;
    }
    device::DigitSpread spread;
    spread.choose(mask);
    INFO(number << " to " << mask);
    REQUIRE(spread.of(number) == expected);
  }
}

TEST_CASE("Along one axis keys never decrease", "[elements]") {
  Random random(sap_test::seedOr(96));
  for (const double length : {1e-38, 1.0, 12345.0, 1e37}) {
    const double range[3] = {length, 0, 0}, size[3] = {length / 100, length / 100, length / 100};
    const CurvedBoxes scene(2000, range, size, device::curve_digits, random);
    std::vector<device::Record> boxes = scene.boxes;
    std::sort(boxes.begin(), boxes.end(), [](const device::Record& a, const device::Record& b) {
      return CurvedBoxes::centre(a, 0) < CurvedBoxes::centre(b, 0);
    });
    const auto keyOf = [&](const device::Record& box) { return scene.curve.keyOf(box); };
    for (std::size_t i = 1; i < boxes.size(); ++i) REQUIRE(keyOf(boxes[i - 1]) <= keyOf(boxes[i]));
    CHECK(keyOf(boxes.front()) == 0);
    CHECK(keyOf(boxes.back()) >> 4 == (1u << (device::curve_digits - 4)) - 1);  // 24 of 27 digits
  }
}

namespace {

// How many of all keys share the digits from `shift` on with this one.
template <class Key>
std::size_t alike(const std::vector<Key>& keys, Key key, int shift) {
  return static_cast<std::size_t>(std::count_if(
      keys.begin(), keys.end(), [&](Key other) { return other >> shift == key >> shift; }));
}

template <class Key>
void checkCuts(std::vector<Key> keys) {
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
}

}  // namespace

TEST_CASE("More boxes with one key than a search can bear are a cluster", "[elements]") {
  for (const std::size_t before : {0, 1, 700})
    for (const std::size_t count : {1, 33, 1024, 1025, 5000}) {
      std::vector<std::uint32_t> keys(before, 6);
      keys.insert(keys.end(), count, 7);
      keys.push_back(8);
      int clusters = 0;
      for (std::size_t i = 0; i < keys.size(); ++i)
        clusters += device::cellCutAt(keys.data(), keys.size(), i).cluster;
      INFO(count << " boxes behind " << before);
      CHECK(clusters == (count > device::cluster_size ? 1 : 0));
    }
}

TEST_CASE("Cells are whole blocks of space, of 32 boxes at most", "[elements]") {
  Random random(sap_test::seedOr(97));
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

TEST_CASE("Each cell is dealt to one warp of one part, whoever is done first", "[elements]") {
  Random random(sap_test::seedOr(100));
  for (int round = 0; round < 300; ++round) {
    const auto cells = static_cast<std::uint32_t>(random.below(5000));
    const std::uint32_t parts = 1 + random.below(device::most_parts);
    const std::uint32_t warps = device::CellDealer::together * (1 + random.below(60));
    INFO(cells << " cells, " << parts << " parts, " << warps << " warps");
    std::vector<int> times(cells, 0);
    for (std::uint32_t part = 0; part < parts; ++part) {
      const device::CellDealer dealer({part, parts}, cells, warps);
      std::vector<std::uint32_t> at(warps);
      for (std::uint32_t warp = 0; warp < warps; ++warp) at[warp] = warp;
      std::uint32_t asked = 0;
      while (!at.empty()) {
        std::uint32_t& own = at[random.below(static_cast<std::uint32_t>(at.size()))];
        const std::uint32_t cell = dealer.cellOf(own);
        if (cell >= cells) {
          own = at.back();
          at.pop_back();
          continue;
        }
        ++times[cell];
        own = dealer.isInStrides(dealer.after(own)) ? dealer.after(own) : dealer.forAsking(asked++);
      }
    }
    CHECK(std::count(times.begin(), times.end(), 1) == static_cast<std::ptrdiff_t>(cells));
  }
}

TEST_CASE("Rows have room for what slots have, and keep their length while they do", "[elements]") {
  using device::rowLengthFor;
  constexpr double places = device::row_places_a_pair;
  Random random(sap_test::seedOr(102));
  std::uint32_t last = 0;
  for (int frame = 0; frame < 100000; ++frame) {
    const double pairs = 40 * random.unit() * random.unit();
    const std::uint32_t length = rowLengthFor(pairs, last);
    INFO(pairs << " pairs a slot, rows of " << last << " before, of " << length << " now");
    REQUIRE((length == 0) == (pairs * places > device::most_row));
    if (length) {
      const double wanted = pairs * places;
      REQUIRE(length % device::least_row == 0);
      REQUIRE(length >= wanted);
      REQUIRE(length <= std::max<double>(device::least_row, 4 * wanted));
      // A scene that moves a little has the same rows, and with them the same graph.
      REQUIRE(rowLengthFor(pairs * 0.9, length) ==
              (length <= std::max<double>(device::least_row, 3.6 * wanted)
                   ? length
                   : rowLengthFor(pairs * 0.9, 0)));
    }
    last = length;
  }
  // Around a limit.
  const double limit = 2 * device::least_row / places;
  const std::uint32_t length = rowLengthFor(limit * 1.01, 0);
  CHECK(length == 4 * device::least_row);
  CHECK(rowLengthFor(limit * 0.99, length) == length);
  CHECK(rowLengthFor(limit * 1.01, length) == length);
}
