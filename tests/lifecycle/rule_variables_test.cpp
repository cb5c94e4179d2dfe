// The variables of the environment that leave out or add pairs.
#include <ode_parallel_sap/parallel_sap_space.h>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/ode_errors.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

const char* const kSkipStatic = "ODE_PARALLEL_SAP_SKIP_STATIC";
const char* const kSkipAsleep = "ODE_PARALLEL_SAP_SKIP_ASLEEP";
const char* const kCullPlanes = "ODE_PARALLEL_SAP_CULL_PLANES";
const char* const kTolerance = "ODE_PARALLEL_SAP_TOLERANCE";

// Couples of unit boxes, many enough for a scene that is not small, of each kind that a variable
// leaves out or adds. They are in boxes far from each other.
constexpr std::size_t kCouples = 60;

void addCouples(World& world, double side, double gap, bool bodies, bool asleep) {
  for (std::size_t i = 0; i < kCouples; ++i)
    for (const double x : {0.0, 1 + gap}) {
      const double left = 10 * static_cast<double>(i) + x;
      const dGeomID box = world.addBox({{left, side, 0}, {left + 1, side + 1, 1}});
      if (!bodies) continue;
      const dBodyID body = world.giveBody(box);
      if (asleep) dBodyDisable(body);
    }
}

// Pairs of a frame after the first, in a space whose program sets nothing.
struct Scene {
  Scene() {
    addCouples(world, 0, -0.5, false, false);  // static
    addCouples(world, 10, -0.5, true, true);   // asleep
    addCouples(world, 20, 0.05, true, false);  // near
    addCouples(world, 30, -0.5, true, false);  // awake
    world.take(dCreatePlane(space, 1, 1, 1, -100));
  }
  std::size_t pairs() {
    (void)collide(space);
    return collide(space).size();
  }
  Space space;
  World world{space};
};

constexpr std::size_t kStatic = kCouples, kAsleep = kCouples, kAwake = kCouples, kNear = kCouples,
                      kPlane = 8 * kCouples, kAll = kStatic + kAsleep + kAwake + kPlane;

}  // namespace

TEST_CASE("Each variable leaves out or adds the pairs that its setting does", "[rules]") {
  const BareEnvironment bare;
  struct Case {
    const char *variable, *value;
    std::size_t pairs;
  };
  const Messages messages;
  Scene before;
  // The plane is no body's, so it pairs with the static and the sleeping boxes.
  for (const Case& c : {Case{kSkipStatic, "1", kAll - kStatic - 2 * kCouples},
                        {kSkipAsleep, "1", kAll - kAsleep - 2 * kCouples},
                        {kCullPlanes, "1", kAll - kPlane},
                        {kTolerance, "0.2", kAll + kNear},
                        {kTolerance, "2e-1", kAll + kNear},
                        {kTolerance, "0.01", kAll},
                        {kSkipStatic, "0", kAll},
                        {kSkipAsleep, "0", kAll},
                        {kCullPlanes, "0", kAll},
                        {kTolerance, "0", kAll},
                        {kSkipStatic, "", kAll}}) {
    const Variable variable(c.variable, c.value);
    INFO(c.variable << '=' << c.value);
    Scene scene;
    CHECK(scene.pairs() == c.pairs);
  }
  CHECK(before.pairs() == kAll);
  CHECK(messages.all().empty());
}

TEST_CASE("A program that sets something has the last word over these variables", "[rules]") {
  const BareEnvironment bare;
  const Variable skip_static(kSkipStatic, "1"), skip_asleep(kSkipAsleep, "1"),
      cull_planes(kCullPlanes, "1"), tolerance(kTolerance, "0.25");
  Scene scene;
  CHECK(dParallelSAPSpaceGetSkipStatic(scene.space) == 1);
  CHECK(dParallelSAPSpaceGetSkipAsleep(scene.space) == 1);
  CHECK(dParallelSAPSpaceGetCullPlanes(scene.space) == 1);
  CHECK(dParallelSAPSpaceGetTolerance(scene.space) == dReal(0.25));
  CHECK(scene.pairs() == kAwake + kNear);
  dParallelSAPSpaceSetSkipStatic(scene.space, 0);
  dParallelSAPSpaceSetSkipAsleep(scene.space, 0);
  dParallelSAPSpaceSetCullPlanes(scene.space, 0);
  dParallelSAPSpaceSetTolerance(scene.space, 0);
  CHECK(scene.pairs() == kAll);
}
