// Piles in which all moves by next to nothing: what is kept of one frame must not show in the next.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

// Boxes and balls, most with bodies, that tremble on a plane. Now and then something happens to
// some of them.
class TremblingPile {
 public:
  TremblingPile(const Configuration& configuration, std::size_t n, std::uint64_t seed)
      : space_(configuration), world_(space_), random_(seed) {
    reach_ = std::cbrt(static_cast<double>(n));
    take(dCreatePlane(space_, 0, 0, 1, 0));
    while (order_.size() < n) add();
  }

  dSpaceID space() const { return space_; }
  const std::vector<dGeomID>& order() const { return order_; }

  void tremble(double distance) {
    for (std::size_t i = 1; i < order_.size(); ++i) move(order_[i], distance);
  }
  void disturb() {
    const std::size_t at = 1 + random_.below(order_.size() - 1);
    const dGeomID geom = order_[at];
    switch (random_.below(8)) {
      case 0:  // rolls off
        for (int i = 0; i < 5; ++i) move(order_[1 + random_.below(order_.size() - 1)], 1);
        break;
      case 1:
        dGeomIsEnabled(geom) ? dGeomDisable(geom) : dGeomEnable(geom);
        break;
      case 2:
        dGeomSetCategoryBits(geom, random_.chance(0.5) ? ~0ul : 1ul << random_.below(3));
        break;
      case 3:
        dGeomSetCollideBits(geom, random_.chance(0.5) ? ~0ul : random_.below(8));
        break;
      case 4:
        if (const dBodyID body = dGeomGetBody(order_[1 + random_.below(order_.size() - 1)]))
          dGeomSetBody(geom, body);
        break;
      case 5:
        world_.remove(order_.back());
        order_.pop_back();
        break;
      case 6:
        world_.remove(geom);
        order_.erase(order_.begin() + static_cast<std::ptrdiff_t>(at));
        add();
        break;
      case 7:
        if (dGeomGetClass(geom) == dSphereClass)
          dGeomSphereSetRadius(geom, random_.chance(0.2) ? std::numeric_limits<dReal>::infinity()
                                                         : random_.between(0.2, 1));
        break;
    }
  }

 private:
  void take(dGeomID geom) { order_.push_back(world_.take(geom)); }
  void add() {
    take(random_.chance(0.5) ? dCreateSphere(space_, random_.between(0.3, 0.6))
                             : dCreateBox(space_, 1, random_.between(0.5, 2), 1));
    const auto anywhere = [&] { return random_.between(0, reach_); };
    const double x = anywhere(), y = anywhere();
    dGeomSetPosition(order_.back(), x, y, anywhere());
    if (random_.chance(0.7)) world_.giveBody(order_.back());
  }
  void move(dGeomID geom, double distance) {
    const dReal* const place = dGeomGetPosition(geom);
    const dReal x = place[0], y = place[1], z = place[2];
    const auto far = [&] { return random_.between(-distance, distance); };
    const double dx = far(), dy = far();
    dGeomSetPosition(geom, x + dx, y + dy, z + far());
  }

  Space space_;
  World world_;
  Random random_;
  std::vector<dGeomID> order_;
  double reach_;
};

const Configuration on_cpu = {dParallelSAPBackendCPU, dParallelSAPMethodAuto, "auto"};

}  // namespace

TEST_CASE("While a pile trembles, the pairs of every frame are those of the formula",
          "[trembling]") {
  const std::uint64_t seed = seedOr(121);
  for (const int threads : {1, 3}) {
    TremblingPile pile(on_cpu, 900, seed);
    Random random(seed);
    dParallelSAPSpaceSetNumThreads(pile.space(), threads);
    int kept = 0;
    const int frames = scaled(150);
    for (int frame = 0; frame < frames; ++frame) {
      INFO(threads << " threads, seed " << seed << ", frame " << frame);
      const Pairs pairs = collide(pile.space());
      REQUIRE(difference(pairs, expectedPairs(pile.order())) == "");
      const dParallelSAPStats stats = statsOf(pile.space());
      kept += stats.candidates_kept > 0;
      if (stats.candidates_kept > 0) CHECK(stats.kept == 0);
      pile.tremble(random.chance(0.03) ? 0.3 : 0.001);
      while (random.chance(0.4)) pile.disturb();
    }
    CHECK(kept > frames / 2);
  }
}

TEST_CASE("Candidates are kept in a pile that trembles, and none where all moves far",
          "[trembling]") {
  struct Motion {
    double distance;
    bool keeps;
  };
  for (const Motion motion : {Motion{0.001, true}, Motion{0.4, false}}) {
    TremblingPile pile(on_cpu, 1500, 122);
    for (int frame = 0; frame < 40; ++frame) {
      const Pairs pairs = collide(pile.space());
      const dParallelSAPStats stats = statsOf(pile.space());
      INFO("by " << motion.distance << ", frame " << frame);
      if (frame > 0) CHECK(stats.moved >= 1499);
      if (motion.keeps && frame > 1) {
        CHECK(stats.candidates_kept >= pairs.size() * 9 / 10);
        CHECK(stats.candidates_kept < 2 * pairs.size());
      } else {
        CHECK(stats.candidates_kept == 0);
      }
      pile.tremble(motion.distance);
    }
  }
}

TEST_CASE("Pairs stay exact where a pile rests, trembles and is stirred in turn", "[trembling]") {
  const std::uint64_t seed = seedOr(123);
  TremblingPile pile(on_cpu, 900, seed);
  Random random(seed);
  for (int frame = 0; frame < scaled(120); ++frame) {
    INFO("seed " << seed << ", frame " << frame);
    REQUIRE(difference(collide(pile.space()), expectedPairs(pile.order())) == "");
    switch (frame / 6 % 4) {
      case 0:
      case 1:
        pile.tremble(0.001);
        break;
      case 2:
        for (std::size_t i = random.below(30); i > 0; --i) pile.disturb();
        break;
      case 3:
        pile.tremble(random.chance(0.5) ? 0.001 : 0.3);
        break;
    }
  }
}

TEST_CASE("A pile that has come to rest gives back what was held while it trembled",
          "[trembling]") {
  TremblingPile pile(on_cpu, 1500, 124);
  const auto frames = [&](int count, double distance) {
    for (int frame = 0; frame < count; ++frame) {
      if (distance > 0) pile.tremble(distance);
      collide(pile.space());
    }
    return statsOf(pile.space());
  };
  CHECK(frames(10, 0.001).candidates_kept > 0);
  const auto held = frames(20, 0).memory_bytes;
  const auto left = frames(80, 0).memory_bytes;
  CHECK(left + 36 * 1500 < held);
  CHECK(frames(10, 0.001).candidates_kept > 0);
}
