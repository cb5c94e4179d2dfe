#include "yard.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <chrono>
#include <cmath>
#include <cstdint>

namespace scene {
namespace {

// What a geom is, as a category. Who meets whom is one rule, which the callback asks pair by pair
// or the space is told beforehand.
enum Layer : unsigned long { ground = 1, solid = 2, dust = 4, bullet = 8 };

unsigned long partnersOf(unsigned long layer) {
  switch (layer) {
    case ground:
      return solid | dust | bullet;
    case solid:
      return ground | solid | bullet;
    case dust:
      return ground;
    default:
      return ground | solid;
  }
}

unsigned long layerOf(dGeomID geom) {
  return static_cast<unsigned long>(reinterpret_cast<std::uintptr_t>(dGeomGetData(geom)));
}

bool meet(dGeomID a, dGeomID b) {
  return (partnersOf(layerOf(a)) & layerOf(b)) != 0;
}

bool isAwake(dGeomID geom) {
  const dBodyID body = dGeomGetBody(geom);
  return body && dBodyIsEnabled(body);
}

constexpr dReal frame_time = dReal(0.01);  // seconds
constexpr int fast_steps = 10;             // a frame, so that no bullet is beyond a wall in one
constexpr dReal tile = 4, wall_y = -60;    // metres
constexpr dReal wall_thickness = dReal(0.2);
constexpr dReal log_radius = dReal(0.3);
constexpr int log_parts = 12;
constexpr dReal far_away = 30;       // metres from the camera, which is at one end of the logs
constexpr dReal bullet_speed = 100;  // metres a second
constexpr dReal bullet_kg = dReal(0.05);

dReal real(double value) {
  return static_cast<dReal>(value);
}

}  // namespace

Yard::Yard(const Measures& measures, double size)
    : measures_(measures), world_(dWorldCreate()), fast_world_(world_) {
  bodies_ = ground_ = fast_bodies_ = dParallelSAPSpaceCreate(nullptr);
  if (measures.apart) ground_ = dParallelSAPSpaceCreate(nullptr);
  if (measures.substeps) {
    fast_world_ = dWorldCreate();
    fast_bodies_ = dParallelSAPSpaceCreate(nullptr);
  }
  for (const dWorldID world : {world_, fast_world_}) {
    dWorldSetGravity(world, 0, 0, real(-9.81));
    dWorldSetQuickStepNumIterations(world, 10);
    dWorldSetContactMaxCorrectingVel(world, 1);
    dWorldSetContactSurfaceLayer(world, real(0.001));
  }
  if (measures.asleep) {
    // Nobody sleeps in ODE who is not allowed to; and who sleeps is still found in pairs.
    dWorldSetAutoDisableFlag(world_, 1);
    dWorldSetAutoDisableLinearThreshold(world_, real(0.1));
    dWorldSetAutoDisableAngularThreshold(world_, real(0.2));
    dWorldSetAutoDisableSteps(world_, 20);
    dParallelSAPSpaceSetSkipAsleep(bodies_, 1);
  }
  joints_ = dJointGroupCreate(0);
  addGround(40);
  addCrates(static_cast<int>(60 * size));
  addLogs(static_cast<int>(30 * size));
  addDust(static_cast<int>(800 * size));
  addBullets(40);
}

Yard::~Yard() {
  dJointGroupDestroy(joints_);
  dSpaceDestroy(bodies_);
  if (ground_ != bodies_) dSpaceDestroy(ground_);
  if (fast_bodies_ != bodies_) dSpaceDestroy(fast_bodies_);
  dWorldDestroy(world_);
  if (fast_world_ != world_) dWorldDestroy(fast_world_);
}

// Layers: with these bits a pair that does not meet is never found.
void Yard::mark(dGeomID geom, unsigned long layer) {
  dGeomSetData(geom, reinterpret_cast<void*>(static_cast<std::uintptr_t>(layer)));
  if (!measures_.layers) return;
  dGeomSetCategoryBits(geom, layer);
  dGeomSetCollideBits(geom, 0);  // ODE pairs two geoms if either one wants the other
  if (layer == ground) return;
  dGeomSetCollideBits(geom, partnersOf(layer));
}

dBodyID Yard::addBody(dWorldID world, dReal x, dReal y, dReal z, dReal kg) {
  const dBodyID body = dBodyCreate(world);
  dMass mass;
  dMassSetBoxTotal(&mass, kg, 1, 1, 1);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, x, y, z);
  return body;
}

void Yard::addGround(int tiles) {
  const dReal half = real(tiles - 1) / 2;
  for (int i = 0; i < tiles * tiles; ++i) {
    const dGeomID geom = dCreateBox(ground_, tile, tile, 1);
    dGeomSetPosition(geom, tile * (real(i % tiles) - half), tile * (real(i / tiles) - half),
                     real(-0.5));
    mark(geom, ground);
  }
  const dGeomID wall = dCreateBox(ground_, wall_thickness, 30, 4);
  dGeomSetPosition(wall, wall_thickness / 2, wall_y, 2);
  mark(wall, ground);
}

void Yard::addCrates(int stacks) {
  constexpr int high = 5;
  for (int i = 0; i < high * stacks; ++i) {
    const int stack = i / high;
    const dGeomID geom = dCreateBox(bodies_, 1, 1, 1);
    dGeomSetBody(geom, addBody(world_, real(3 * (stack % 10) - 15), real(40 + 3 * (stack / 10)),
                               real(0.5 + i % high), 50));
    mark(geom, solid);
  }
}

// Logs lie along x, four beside each other. A capsule has nearly the shape of the twelve spheres.
void Yard::addLogs(int columns) {
  constexpr int rows = 4;
  dMatrix3 along_x;
  dRFromAxisAndAngle(along_x, 0, 1, 0, real(M_PI / 2));
  for (int i = 0; i < columns * rows; ++i) {
    const dReal half = log_radius * real(log_parts - 1) / 2;
    Log log;
    log.body =
        addBody(world_, real(4.2 * (i / rows) - 63), real(0.62 * (i % rows)), log_radius, 80);
    for (int part = 0; part < log_parts; ++part) {
      log.parts.push_back(dCreateSphere(bodies_, log_radius));
      dGeomSetBody(log.parts.back(), log.body);
      dGeomSetOffsetPosition(log.parts.back(), log_radius * real(part) - half, 0, 0);
      mark(log.parts.back(), solid);
    }
    log.proxy = dCreateCapsule(bodies_, log_radius, 2 * half);
    dGeomSetBody(log.proxy, log.body);
    dGeomSetOffsetRotation(log.proxy, along_x);
    dGeomDisable(log.proxy);
    mark(log.proxy, solid);
    logs_.push_back(log);
  }
}

// A low cloud that sinks slowly.
void Yard::addDust(int grains) {
  dRandSetSeed(1);
  for (int i = 0; i < grains; ++i) {
    const dGeomID geom = dCreateSphere(bodies_, real(0.4));
    const dBodyID body = addBody(world_, 40 + 20 * dRandReal(), -40 + 20 * dRandReal(),
                                 real(0.3) + 3 * dRandReal(), real(0.01));
    dBodySetGravityMode(body, 0);
    dBodySetLinearVel(body, 0, 0, real(-0.2));
    dGeomSetBody(geom, body);
    mark(geom, dust);
  }
}

void Yard::addBullets(int count) {
  for (int i = 0; i < count; ++i) {
    const dGeomID geom = dCreateSphere(fast_bodies_, real(0.1));
    const dBodyID body = addBody(fast_world_, real(-10 - 0.07 * i), wall_y + real(0.5 * i - 10),
                                 real(1.5), bullet_kg);
    dBodySetGravityMode(body, 0);
    dBodySetAutoDisableFlag(body, 0);
    dGeomSetBody(geom, body);
    mark(geom, bullet);
    bullets_.push_back(body);
  }
}

void Yard::shoot() {
  for (const dBodyID body : bullets_) dBodySetLinearVel(body, bullet_speed, 0, 0);
}

int Yard::behindWall() const {
  int behind = 0;
  for (const dBodyID body : bullets_) behind += dBodyGetPosition(body)[0] > wall_thickness;
  return behind;
}

void Yard::near(void* data, dGeomID a, dGeomID b) {
  Yard& yard = *static_cast<Yard*>(data);
  ++yard.work_.pairs;
  if (!meet(a, b) || !(isAwake(a) || isAwake(b))) return;
  dContact contacts[4] = {};
  const int count = dCollide(a, b, 4, &contacts[0].geom, sizeof(dContact));
  for (int i = 0; i < count; ++i) {
    contacts[i].surface.mode = dContactApprox1;
    contacts[i].surface.mu = real(0.5);
    dJointAttach(dJointCreateContact(yard.world_, yard.joints_, &contacts[i]), dGeomGetBody(a),
                 dGeomGetBody(b));
  }
  yard.work_.contacts += static_cast<std::size_t>(count);
}

// A bullet is stopped as by something that cannot move: joints do not reach from world to world.
// What it hits gets its momentum with the next step of its own world.
void Yard::nearFast(void* data, dGeomID a, dGeomID b) {
  Yard& yard = *static_cast<Yard*>(data);
  ++yard.work_.pairs;
  if (layerOf(a) != bullet) std::swap(a, b);
  if (!meet(a, b)) return;
  dContact contact = {};
  if (!dCollide(a, b, 1, &contact.geom, sizeof(dContact))) return;
  const dBodyID shot = dGeomGetBody(a);
  dJointAttach(dJointCreateContact(yard.fast_world_, yard.joints_, &contact), shot, nullptr);
  ++yard.work_.contacts;
  if (const dBodyID hit = dGeomGetBody(b)) {
    const dReal* const speed = dBodyGetLinearVel(shot);
    const dReal force = bullet_kg / frame_time;
    dBodyEnable(hit);
    dBodyAddForce(hit, force * speed[0], force * speed[1], force * speed[2]);
  }
}

// Apart: the pairs of the bodies, then those of bodies and ground; the ground's own are no pairs.
void Yard::collide() {
  dSpaceCollide(bodies_, this, near);
  if (ground_ != bodies_)
    dSpaceCollide2(reinterpret_cast<dGeomID>(bodies_), reinterpret_cast<dGeomID>(ground_), this,
                   near);
}

void Yard::step(dReal dt) {
  collide();
  dWorldQuickStep(world_, dt);
  dJointGroupEmpty(joints_);
}

void Yard::stepFast(dReal dt) {
  const auto fast = reinterpret_cast<dGeomID>(fast_bodies_);
  dSpaceCollide2(fast, reinterpret_cast<dGeomID>(bodies_), this, nearFast);
  if (ground_ != bodies_) dSpaceCollide2(fast, reinterpret_cast<dGeomID>(ground_), this, nearFast);
  dWorldQuickStep(fast_world_, dt);
  dJointGroupEmpty(joints_);
}

// A disabled geom is in no pair, and takes next to nothing.
void Yard::chooseProxies() {
  const dReal camera = -63;
  for (const Log& log : logs_) {
    const bool is_far = dBodyGetPosition(log.body)[0] - camera > far_away;
    if (is_far == (dGeomIsEnabled(log.proxy) != 0)) continue;
    (is_far ? dGeomEnable : dGeomDisable)(log.proxy);
    for (const dGeomID part : log.parts) (is_far ? dGeomDisable : dGeomEnable)(part);
  }
}

void Yard::settle(int frames) {
  if (measures_.proxies) chooseProxies();
  for (int frame = 0; frame < frames; ++frame) step(frame_time);
}

Work Yard::frame() {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  work_ = {};
  if (measures_.proxies) chooseProxies();
  if (measures_.substeps) {
    for (int i = 0; i < fast_steps; ++i) stepFast(frame_time / fast_steps);
    step(frame_time);
  } else if (measures_.tunnel) {
    step(frame_time);
  } else {
    for (int i = 0; i < fast_steps; ++i) step(frame_time / fast_steps);
  }
  work_.ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  return work_;
}

}  // namespace scene
