// The number of threads changes the time, never the sequence.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

// The pairs of each frame of a scene that moves, in a space of its own.
std::vector<Pairs> play(const Configuration& configuration, int threads, std::uint64_t seed) {
  const Space space(configuration);
  dParallelSAPSpaceSetNumThreads(space, threads);
  World world(space);
  world.addBoxes(denseCube(geomsOf(2500) + 10 * (seed % 3), seed));
  std::vector<Pairs> frames;
  for (int frame = 0; frame < scaled(12); ++frame) {
    world.jitter(0.3, 100 * seed + static_cast<std::uint64_t>(frame));
    frames.push_back(collide(space));
  }
  return frames;
}

}  // namespace

TEST_CASE("Spaces are created, used and destroyed by different threads at once", "[threads]") {
  const std::uint64_t seed = seedOr(43);
  for (const Configuration& configuration : configurations())
    for (const int threads_each : {1, 3}) {
      std::vector<std::vector<Pairs>> alone, at_once(3);
      for (std::uint64_t i = 0; i < 3; ++i)
        alone.push_back(play(configuration, threads_each, seed + i));
      std::vector<std::thread> workers;
      for (std::size_t i = 0; i < 3; ++i)
        workers.emplace_back([&, i] {
          if (dAllocateODEDataForThread(dAllocateMaskAll))
            at_once[i] = play(configuration, threads_each, seed + i);
        });
      for (std::thread& worker : workers) worker.join();
      for (std::size_t i = 0; i < 3; ++i) {
        INFO(configuration.name << ", " << threads_each << " threads each, space " << i);
        for (const Pairs& frame : alone[i]) REQUIRE(!frame.empty());
        REQUIRE((at_once[i] == alone[i]));
      }
    }
}

namespace {

// A world as the guide has it: of one thread, with a stepping implementation of its own.
class SteppedWorld {
 public:
  explicit SteppedWorld(int number) {
    dWorldSetGravity(world_, 0, 0, dReal(-9.81));
    dWorldSetStepThreadingImplementation(world_, dThreadingImplementationGetFunctions(stepping_),
                                         stepping_);
    dParallelSAPSpaceSetNumThreads(space_, 1);
    dCreatePlane(space_, 0, 0, 1, 0);
    for (int i = 0; i < 20 + number; ++i) {
      const dBodyID body = dBodyCreate(world_);
      dMass mass;
      dMassSetSphere(&mass, 1, 1);
      dBodySetMass(body, &mass);
      dBodySetPosition(body, dReal(i % 5) * 3, dReal(i / 5) * 3, dReal(1) + dReal(0.1) * i);
      dGeomSetBody(dCreateSphere(space_, 1 + dReal(0.05) * i), body);
      bodies_.push_back(body);
    }
  }
  ~SteppedWorld() {
    dJointGroupDestroy(joints_);
    for (const dBodyID body : bodies_) dGeomDestroy(dBodyGetFirstGeom(body));
    dWorldDestroy(world_);
    dThreadingFreeImplementation(stepping_);
  }
  SteppedWorld(const SteppedWorld&) = delete;
  SteppedWorld& operator=(const SteppedWorld&) = delete;

  void step() {
    dSpaceCollide(space_, this, makeJoints);
    dWorldStep(world_, dReal(0.01));
    dJointGroupEmpty(joints_);
  }
  std::vector<dReal> places() const {
    std::vector<dReal> places;
    for (const dBodyID body : bodies_)
      places.insert(places.end(), dBodyGetPosition(body), dBodyGetPosition(body) + 3);
    return places;
  }

 private:
  static void makeJoints(void* data, dGeomID a, dGeomID b) {
    const SteppedWorld& self = *static_cast<SteppedWorld*>(data);
    dContact contacts[4] = {};
    const int count = dCollide(a, b, 4, &contacts[0].geom, sizeof contacts[0]);
    for (int i = 0; i < count; ++i) {
      contacts[i].surface.mode = dContactBounce;
      contacts[i].surface.mu = dReal(0.5);
      contacts[i].surface.bounce = dReal(0.3);
      dJointAttach(dJointCreateContact(self.world_, self.joints_, &contacts[i]), dGeomGetBody(a),
                   dGeomGetBody(b));
    }
  }

  const Space space_;
  const dWorldID world_ = dWorldCreate();
  const dJointGroupID joints_ = dJointGroupCreate(0);
  const dThreadingImplementationID stepping_ = dThreadingAllocateSelfThreadedImplementation();
  std::vector<dBodyID> bodies_;
};

// Where the bodies of eight worlds are in the end, each stepped by one of some threads.
std::vector<std::vector<dReal>> stepWorlds(std::size_t threads) {
  constexpr std::size_t worlds = 8;
  std::vector<std::vector<dReal>> places(worlds);
  std::vector<std::thread> workers;
  for (std::size_t thread = 0; thread < threads; ++thread)
    workers.emplace_back([&, thread] {
      if (!dAllocateODEDataForThread(dAllocateMaskAll)) return;
      for (std::size_t i = thread; i < worlds; i += threads) {
        SteppedWorld world(static_cast<int>(i));
        for (int step = 0; step < scaled(60); ++step) world.step();
        places[i] = world.places();
      }
      dCleanupODEAllDataForThread();
    });
  for (std::thread& worker : workers) worker.join();
  return places;
}

}  // namespace

TEST_CASE("Worlds that step on several threads end as on one", "[threads]") {
  const auto alone = stepWorlds(1);
  for (const std::vector<dReal>& places : alone) REQUIRE(!places.empty());
  for (int run = 0; run < 3; ++run) REQUIRE((stepWorlds(4) == alone));
}
