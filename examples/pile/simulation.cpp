#include "simulation.h"

#include <chrono>
#include <cmath>

#include "scenes.h"

namespace pile {
namespace {

// Resting contacts keep a little depth, so that they stay in touch instead of coming and going;
// what is deeper is pushed out, no faster than a body may be without waking its neighbours much.
constexpr double resting_depth = 0.002;  // metres
constexpr double push_out_speed = 1.0;   // metres a second

// Rates per second; that of rotation stands in for rolling friction.
constexpr double linear_damping = 0.1;
constexpr double angular_damping = 2;

// A body sleeps when its mean velocity over a while has been below these for half a second: bodies
// of about one metre that go nowhere, though the solver may jitter them.
constexpr double sleep_speed = 0.08;     // metres a second
constexpr double sleep_rotation = 0.15;  // radians a second
constexpr double sleep_time = 0.5;       // seconds
constexpr double sleep_window = 0.2;     // seconds to take the mean over

double millisecondsOf(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - start;
  return passed.count();
}

void queuePair(void* data, dGeomID first, dGeomID second) {
  static_cast<std::vector<Pair>*>(data)->push_back({first, second});
}

// What is lost in one step of a velocity that decays at this rate per second.
dReal fractionLost(double rate, double dt) {
  return static_cast<dReal>(1 - std::exp(-rate * dt));
}

// Bodies have settings of their own: the world's are only the defaults of those created later.
void setBody(dBodyID body, double dt) {
  dBodySetLinearDamping(body, fractionLost(linear_damping, dt));
  dBodySetAngularDamping(body, fractionLost(angular_damping, dt));
  dBodySetAutoDisableFlag(body, 1);
  dBodySetAutoDisableLinearThreshold(body, static_cast<dReal>(sleep_speed));
  dBodySetAutoDisableAngularThreshold(body, static_cast<dReal>(sleep_rotation));
  dBodySetAutoDisableSteps(body, 0);
  dBodySetAutoDisableTime(body, static_cast<dReal>(sleep_time));
  dBodySetAutoDisableAverageSamplesCount(body,
                                         static_cast<unsigned>(std::lround(sleep_window / dt)) + 1);
}

}  // namespace

Simulation::Simulation(World& world, const Options& options)
    : world_(world),
      dt_(presetOf(options.scene).dt),
      joints_(dJointGroupCreate(0)),
      parallel_narrow_(options.parallel_narrow),
      narrow_phase_(presetOf(options.scene).contacts) {
  dWorldSetCFM(world.ode(), static_cast<dReal>(1e-5));  // ODE's own in single precision
  dWorldSetContactSurfaceLayer(world.ode(), static_cast<dReal>(resting_depth));
  dWorldSetContactMaxCorrectingVel(world.ode(), static_cast<dReal>(push_out_speed));
  for (dBodyID body : world.bodies()) setBody(body, dt_);
  dRandSetSeed(options.seed);  // QuickStep shuffles its rows
  if (options.check) check_.emplace(world.geoms());
}

Simulation::~Simulation() {
  dJointGroupDestroy(joints_);
}

Frame Simulation::step() {
  Frame frame;
  frame.number = ++steps_done_;
  parallel_narrow_ ? findContacts(frame) : collide(frame);
  frame.joints_ms = millisecondsOf([&] { createJoints(); });
  frame.solver_ms = millisecondsOf([&] { dWorldQuickStep(world_.ode(), static_cast<dReal>(dt_)); });
  frame.joints_ms += millisecondsOf([&] { dJointGroupEmpty(joints_); });
  frame.contacts = contacts_.size();
  return frame;
}

// Pairs, then contacts, in two calls.
void Simulation::collide(Frame& frame) {
  frame.broad_ms = millisecondsOf([&] { queuePairs(); });
  frame.pairs = pairs_.size();
  const bool ours = dSpaceIsParallelSAP(world_.space()) != 0;
  if (ours) {
    dParallelSAPSpaceGetStats(world_.space(), &frame.stages.emplace());
    frame.broad_threads = frame.stages->find_threads;
  }
  if (check_) difference_ = check_->compare(pairs_, ours);
  frame.narrow_ms = millisecondsOf([&] { narrow_phase_.run(pairs_, contacts_); });
}

// Both in one call. What that does not show, the pairs, is asked for afterwards if they are
// checked.
void Simulation::findContacts(Frame& frame) {
  const double both = millisecondsOf([&] { narrow_phase_.run(world_.space(), contacts_); });
  dParallelSAPStats& stages = frame.stages.emplace();
  dParallelSAPSpaceGetStats(world_.space(), &stages);
  frame.broad_threads = stages.find_threads;
  frame.narrow_threads = stages.narrow_threads;
  frame.pairs = stages.pairs;
  frame.narrow_ms = stages.narrow_ms + stages.report_ms;
  frame.broad_ms = both - frame.narrow_ms;
  stages.report_ms = 0;  // it reported contacts, not pairs
  if (!check_) return;
  queuePairs();
  difference_ = check_->compare(pairs_, true);
}

void Simulation::queuePairs() {
  pairs_.clear();
  dSpaceCollide(world_.space(), &pairs_, queuePair);
}

void Simulation::createJoints() {
  dContact contact = {};
  contact.surface.mode = dContactApprox1;
  contact.surface.mu = static_cast<dReal>(world_.friction);
  for (const dContactGeom& geom : contacts_) {
    contact.geom = geom;
    const dJointID joint = dJointCreateContact(world_.ode(), joints_, &contact);
    dJointAttach(joint, dGeomGetBody(geom.g1), dGeomGetBody(geom.g2));
  }
}

}  // namespace pile
