// Bounds that nobody should have: NaN, infinite, inverted, denormal, huge, far away.
#include "support/floating_point.h"
#include "support/tests.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

const dReal kSignalling = std::numeric_limits<dReal>::signaling_NaN();

}  // namespace

TEST_CASE("A NaN bound leaves its geom out, is reported once, counted always, and heals",
          "[bounds]") {
  const unsigned modes[] = {FloatingPointMode::kDefault, FloatingPointMode::kTrapping,
                            FloatingPointMode::kFlushing};
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : kSceneSizes) {
      const int step = n > 1000 ? 5 : 1;
      for (int bound = 0; bound < 6; bound += step) {
        const Space space(configuration);
        World world(space, denseCube(n - 2, 8));
        const Bounds sound = {-100, 100, -100, 100, -100, 100};
        const dGeomID sick = world.take(createUserBox(space, sound));
        const dGeomID ball = world.take(dCreateSphere(space, 100));
        const Messages messages;
        INFO(configuration.name << ", " << n << " geoms, bound " << bound);
        const Pairs healthy = collide(space);
        REQUIRE(difference(healthy, expectedPairs(world.geoms())) == "");
        REQUIRE(statsOf(space).invalid == 0);
        REQUIRE(messages.all().empty());

        Bounds broken = sound;
        broken[bound] = bound % 5 == 0 ? kSignalling : bound % 2 ? kNaN : -kNaN;
        setUserBounds(sick, broken);
        for (const unsigned mode : modes) {
          Pairs got;
          {
            const FloatingPointMode scoped(mode);
            got = collide(space);
          }
          REQUIRE(difference(got, expectedPairs(world.geoms())) == "");
          REQUIRE(got.size() == healthy.size() - (n - 1));
          REQUIRE(statsOf(space).invalid == 1);
          REQUIRE(messages.all().size() == 1);
        }
        dGeomSetPosition(ball, kNaN, 0, 0);
        REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
        REQUIRE(statsOf(space).invalid == 2);
        REQUIRE(messages.all().size() == 2);
        // One that comes is another one, to all that the space can know.
        world.remove(sick);
        (void)collide(space);
        world.addAgain(sick);
        for (int frame = 0; frame < 2; ++frame) {
          REQUIRE(collide(space).size() == healthy.size() - (2 * n - 3));
          REQUIRE(statsOf(space).invalid == 2);
          REQUIRE(messages.all().size() == 3);
        }
        world.remove(ball);
        world.addAgain(ball);
        (void)collide(space);
        REQUIRE(messages.all().size() == 4);
        dGeomSetPosition(ball, 0, 0, 0);
        setUserBounds(sick, sound);
        REQUIRE(difference(collide(space), expectedPairs(world.geoms())) == "");
        REQUIRE(statsOf(space).invalid == 0);
        REQUIRE(messages.all().size() == 4);
      }
    }
  }
}

TEST_CASE("A ray of infinite length along an axis is paired with what is on its way", "[bounds]") {
  for (const Configuration& configuration : configurations()) {
    for (const std::size_t n : {1, 100, 1500}) {
      const Space space(configuration);
      World world(space);
      for (std::size_t i = 0; i < n; ++i)
        dGeomSetPosition(world.take(dCreateBox(space, 1, 1, 1)), -2 * dReal(i), -9, -9);
      const dGeomID ball = world.take(dCreateSphere(space, 1));
      const dGeomID ray = world.take(dCreateRay(space, kInfinity));
      const dGeomID probe = dCreateRay(nullptr, kInfinity);
      setNumber(probe, 9999);
      const Messages messages;
      INFO(configuration.name << ", " << n << " boxes");
      for (int frame = 0; frame < 12; ++frame) {
        dReal along[3] = {0, 0, 0};
        along[frame % 3] = frame % 2 ? 1 : -1;
        dGeomSetPosition(ball, 30 * along[0], 30 * along[1], 30 * along[2]);
        for (const dGeomID one : {ray, probe}) {
          dGeomRaySet(one, 0, 0, 0, along[0], along[1], along[2]);
          if (frame >= 6) (void)boundsOf(one);  // makes ODE write its NaN
        }
        REQUIRE(difference(collide2(space, probe), {{n, 9999}, {n + 1, 9999}}) == "");
        REQUIRE(difference(collide(space), {{n, n + 1}}) == "");
      }
      CHECK(statsOf(space).invalid == 0);
      CHECK(messages.all().empty());
      dGeomDestroy(probe);
    }
  }
}

TEST_CASE("The few geoms that move meet others as in any frame, in any floating-point mode",
          "[bounds]") {
  constexpr std::size_t n = 600, moving = 30;
  for (const unsigned mode : {FloatingPointMode::kFlushing, FloatingPointMode::kDownward,
                              FloatingPointMode::kUpward, FloatingPointMode::kTowardZero})
    for (const dReal length : {real(0.1), 1000 * std::numeric_limits<dReal>::denorm_min()}) {
      Random random(seedOr(75));
      const Space space(configurations()[0]);
      World world(space);
      const auto somewhere = [&] {
        Bounds bounds;
        for (std::size_t i = 0; i < 6; i += 2) {
          bounds[i] = length * real(random.below(12));
          bounds[i + 1] = bounds[i] + length * real(1 - random.below(2) * 1e-3);
        }
        return bounds;
      };
      for (std::size_t i = 0; i < n; ++i) world.take(createUserBox(space, somewhere()));
      for (int frame = 0; frame < 4; ++frame) {
        INFO("mode " << std::hex << mode << ", length " << length << ", frame " << frame);
        Pairs got;
        {
          const FloatingPointMode scoped(mode);
          got = collide(space);
        }
        REQUIRE(difference(got, expectedPairs(world.geoms())) == "");
        CHECK((statsOf(space).kept > 0) == (frame > 0));
        for (std::size_t i = 0; i < moving; ++i)
          setUserBounds(world.geoms()[random.below(n)], somewhere());
      }
    }
}
