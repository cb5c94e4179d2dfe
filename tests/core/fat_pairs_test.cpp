// Kept pairs of fat boxes, beside a sweep for the same boxes, with every instruction set.
#include <cmath>
#include <limits>
#include <vector>

#include "space/coherence/fat_pairs.h"
#include "space/data/float_steps.h"
#include "space/simd/kernels.h"
#include "support/case.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"
#include "support/scenes.h"

using namespace ode_parallel_sap;

namespace {

using Outcome = FatPairs::Outcome;

void shift(sap_test::Box& box, int axis, double distance) {
  box.low[axis] += distance;
  box.high[axis] += distance;
}

void tremble(std::vector<sap_test::Box>& scene, double distance, sap_test::Random& random) {
  for (sap_test::Box& box : scene)
    for (int axis = 0; axis < 3; ++axis) shift(box, axis, random.between(-distance, distance));
}

// One sequence of boxes, found both ways.
struct BothWays {
  FatPairs fat_pairs;
  Sweep<float> lent, other;

  // Holds what is handed out against the sweep's, the marks too.
  Outcome step(const Case& wanted, int threads) {
    const Outcome outcome = fat_pairs.look(wanted.boxes, threads, lent);
    if (outcome != Outcome::started && outcome != Outcome::served) return outcome;
    PairList kept, swept;
    fat_pairs.find(wanted.boxes, threads, lent, kept);
    other.find(wanted.boxes, threads, swept);
    REQUIRE(joined(kept) == joined(swept));
    checkBorderlineSegments(kept);
    return outcome;
  }
};

// Places, numbers of every kind and their neighbours.
float anyBound(sap_test::Random& random) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  constexpr float few[] = {0, -0.0f, 1, -1, 1e-45f, -1e-45f, 3e38f, -3e38f, infinity, -infinity};
  float value = few[random.below(sizeof few / sizeof *few)];
  for (std::size_t steps = random.below(4); steps > 0; --steps)
    value = std::nextafter(value, random.chance(0.5) ? infinity : -infinity);
  return value;
}

}  // namespace

TEST_CASE("Kept pairs of fat boxes follow filters that change while all trembles", "[fat_pairs]") {
  const std::uint64_t seed = sap_test::seedOr(10);
  for (const bool of_bodies : {false, true}) {
    sap_test::Random random(seed);
    std::vector<sap_test::Box> scene = sap_test::denseCube(900, seed);
    std::vector<std::uint32_t> kinds(900);
    BothWays both;
    int served = 0;
    for (int frame = 0; frame < 16; ++frame) {
      INFO((of_bodies ? "bodies" : "bits") << ", seed " << seed << ", frame " << frame);
      tremble(scene, 0.001, random);
      for (int i = frame == 0 ? 900 : 10; i > 0; --i)
        kinds[random.below(900)] = static_cast<std::uint32_t>(random.below(3));
      Case wanted = makeCase(scene, false, false);
      wanted.boxes.filter_bits = !of_bodies;
      wanted.boxes.filter_bodies = of_bodies;
      for (Slot slot = 0; slot < 900; ++slot) {
        wanted.boxes.bits[slot] = {1u << kinds[slot], 1u << kinds[slot]};
        wanted.boxes.bodies[slot] = kinds[slot];
      }
      served += both.step(wanted, 2) == Outcome::served;
    }
    CHECK(served == 14);
  }
}

TEST_CASE("Kept pairs of fat boxes are those of a sweep while some boxes leave theirs",
          "[fat_pairs]") {
  const std::uint64_t seed = sap_test::seedOr(5);
  const KernelSet& best = kernelSet();
  for (const KernelSet* const* set = allKernelSets(); *set; ++set)
    for (const bool filtered : {false, true})
      for (const int threads : {1, 3}) {
        chooseKernelSet(**set);
        sap_test::Random random(seed);
        std::vector<sap_test::Box> scene = sap_test::denseCube(900, seed);
        BothWays both;
        int served = 0, kept = 0;
        for (int frame = 0; frame < 24; ++frame) {
          INFO((*set)->name << (filtered ? ", filtered" : "") << ", " << threads
                            << " threads, seed " << seed << ", frame " << frame);
          tremble(scene, 0.001, random);
          if (frame % 3 == 2)
            for (int i = 0; i < 20; ++i) shift(scene[random.below(scene.size())], 0, 0.3);
          // The last slots go and come.
          if (frame > 8) scene.resize(880);
          if (frame > 15)
            for (int i = 0; i < 30; ++i) scene.push_back(scene[random.below(800)]);
          served += both.step(makeCase(scene, false, filtered), threads) == Outcome::served;
          kept += both.fat_pairs.kept() > 0;
        }
        CHECK(served >= 18);
        CHECK(kept >= 18);
      }
  chooseKernelSet(best);
}

TEST_CASE("There are fat boxes where all trembles, and none where much moves far", "[fat_pairs]") {
  sap_test::Random random(6);
  std::vector<sap_test::Box> scene = sap_test::denseCube(900, 6);
  BothWays both;
  std::vector<Outcome> outcomes;
  const auto frame = [&](double distance) {
    tremble(scene, distance, random);
    outcomes.push_back(both.step(makeCase(scene, false, false), 1));
  };
  const auto are = [&](std::vector<Outcome> wanted) {
    CHECK(outcomes == wanted);
    outcomes.clear();
  };
  for (int i = 0; i < 4; ++i) frame(0.001);
  are({Outcome::off, Outcome::started, Outcome::served, Outcome::served});
  for (int i = 0; i < 3; ++i) frame(0.5);
  are({Outcome::off, Outcome::off, Outcome::off});
  CHECK(both.fat_pairs.bytes() < 900 * 36);
  // As soon as all trembles, and given up if that was the last frame of it.
  frame(0.001);
  frame(0.5);
  frame(0.001);
  frame(0.001);
  are({Outcome::started, Outcome::in_vain, Outcome::started, Outcome::served});
}

TEST_CASE("Trees that another frame has made others are not gone on from", "[fat_pairs]") {
  sap_test::Random random(7);
  std::vector<sap_test::Box> scene = sap_test::denseCube(900, 7);
  BothWays both;
  for (int frame = 0; frame < 12; ++frame) {
    INFO("frame " << frame);
    tremble(scene, 0.001, random);
    if (frame > 3) shift(scene[random.below(scene.size())], 1, 1);
    if (frame == 6) {
      const Case others = makeCase(sap_test::denseCube(500, 8), false, false);
      both.lent.build(others.boxes, 1);
    }
    const Outcome outcome = both.step(makeCase(scene, false, false), 2);
    if (frame > 1) CHECK((outcome == Outcome::served) == (frame != 6));
  }
}

TEST_CASE(
    "Boxes of any bounds overlap and lie within others by the formula, and are borderline by "
    "the rule of floats",
    "[fat_pairs]") {
  const std::uint64_t seed = sap_test::seedOr(9);
  sap_test::Random random(seed);
  constexpr std::size_t count = 61;
  std::vector<Box> boxes(count), room(count);
  for (std::vector<Box>* all : {&boxes, &room})
    for (Box& box : *all)
      for (int axis = 0; axis < 3; ++axis) {
        box.lower[axis] = anyBound(random);
        box.upper[axis] = random.chance(0.3) ? anyBound(random) : 3e38f;
      }
  makeInactive(boxes[7]);
  makeInactive(room[11]);
  std::vector<Pair> kept, pairs, exact_pairs;
  std::uint64_t outside = 0;
  for (Slot a = 0; a < count; ++a) {
    bool within = true;
    for (int axis = 0; axis < 3; ++axis)
      within = within && room[a].lower[axis] <= boxes[a].lower[axis] &&
               room[a].upper[axis] >= boxes[a].upper[axis];
    outside |= std::uint64_t{!within && a != 7} << a;
    for (Slot b = a + 1; b < count; ++b) {
      kept.push_back(makePair(a, b));
      bool overlap = true, borderline = false;
      for (int axis = 0; axis < 3; ++axis)
        for (const auto& [low, high] : {std::pair(boxes[a].lower[axis], boxes[b].upper[axis]),
                                        std::pair(boxes[b].lower[axis], boxes[a].upper[axis])}) {
          overlap = overlap && low <= high;
          borderline = borderline || isBorderline(low, high);
        }
      if (!overlap) continue;
      pairs.push_back(makePair(a, b) | (borderline ? borderline_bit : 0));
      exact_pairs.push_back(makePair(a, b));
    }
  }
  REQUIRE(pairs.size() > 100);
  for (const KernelSet* const* set = allKernelSets(); *set; ++set) {
    INFO((*set)->name << ", seed " << seed);
    CHECK((*set)->boxesOutside(boxes.data(), room.data(), count) == outside);
    for (const bool exact : {false, true}) {
      std::vector<Pair> found(kept.size());
      found.resize((*set)->keptPairs(boxes.data(), kept.data(), kept.size(), exact, found.data()));
      CHECK(found == (exact ? exact_pairs : pairs));
    }
  }
}
