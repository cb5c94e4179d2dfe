#include "warehouse.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>

namespace scene {
namespace {

// In metres. Rows of shelves lie along x, with aisles between them. All coordinates are positive:
// dHashSpace misses pairs at the origin.
constexpr int levels = 5, box_count = 300, most_contacts = 4;
constexpr double bay = 2.7, depth = 1, level = 1.2, row = 4, edge = 10;
constexpr double lidar_height = 1.15, lidar_range = 25, way_a_frame = 0.02;
constexpr unsigned long static_bit = 1, solid_bit = 2;

dReal real(double value) {
  return static_cast<dReal>(value);
}

double between(double least, double most) {
  return least + (most - least) * static_cast<double>(dRandReal());
}

// A robot: chassis, battery, wheels, mast, lidar, and an arm with a gripper.
struct Part {
  int shape;
  double size[3], at[3];
};
constexpr Part parts[] = {
    {dBoxClass, {0.8, 0.5, 0.2}, {0, 0, 0.25}},     {dBoxClass, {0.4, 0.4, 0.2}, {-0.1, 0, 0.45}},
    {dSphereClass, {0.125}, {0.3, 0.25, 0.12}},     {dSphereClass, {0.125}, {0.3, -0.25, 0.12}},
    {dSphereClass, {0.125}, {-0.3, 0.25, 0.12}},    {dSphereClass, {0.125}, {-0.3, -0.25, 0.12}},
    {dBoxClass, {0.1, 0.1, 0.6}, {-0.3, 0, 0.8}},   {dSphereClass, {0.08}, {-0.3, 0, lidar_height}},
    {dCapsuleClass, {0.06, 0.3}, {0.25, 0, 0.5}},   {dCapsuleClass, {0.05, 0.3}, {0.25, 0, 0.9}},
    {dBoxClass, {0.3, 0.08, 0.08}, {0.4, 0, 1.05}}, {dBoxClass, {0.1, 0.2, 0.05}, {0.6, 0, 1.05}}};

dGeomID create(dSpaceID space, const Part& part) {
  if (part.shape == dSphereClass) return dCreateSphere(space, real(part.size[0]));
  if (part.shape == dCapsuleClass)
    return dCreateCapsule(space, real(part.size[0]), real(part.size[1]));
  return dCreateBox(space, real(part.size[0]), real(part.size[1]), real(part.size[2]));
}

dSpaceID createSpace(const std::string& name, dSpaceID parent) {
  if (name == "hash") return dHashSpaceCreate(parent);
  if (name == "sap") return dSweepAndPruneSpaceCreate(parent, dSAP_AXES_XYZ);
  if (name == "simple") return dSimpleSpaceCreate(parent);
  return dParallelSAPSpaceCreate(parent);
}

dBodyID bodyOf(dGeomID geom) {  // a sub-space holds one robot, or what is static
  return dGeomGetBody(dGeomIsSpace(geom) ? dSpaceGetGeom(reinterpret_cast<dSpaceID>(geom), 0)
                                         : geom);
}

std::pair<int, int> numbers(dGeomID a, dGeomID b) {
  const auto number = [](dGeomID geom) {
    return static_cast<int>(reinterpret_cast<std::intptr_t>(dGeomGetData(geom)));
  };
  return std::minmax({number(a), number(b)});
}

int flagsOf(void*, dGeomID a, dGeomID b) {
  const auto moves = [](dGeomID geom) { return bodyOf(geom) && dBodyIsEnabled(bodyOf(geom)); };
  return moves(a) || moves(b) ? most_contacts : 0;
}

}  // namespace

Warehouse::Warehouse(const Plan& plan)
    : plan_(plan),
      columns_(static_cast<int>(std::ceil(std::sqrt(1.5 * plan.shelves / levels)))),
      rows_((plan.shelves + levels * columns_ - 1) / (levels * columns_)),
      world_(dWorldCreate()),
      space_(createSpace(plan.space, nullptr)),
      static_(plan.ways.apart ? createSpace(plan.space, space_) : space_),
      floor_(dGeomTriMeshDataCreate()),
      ray_(dCreateRay(nullptr, real(lidar_range))) {
  dGeomRaySetClosestHit(ray_, 1);
  if (dSpaceIsParallelSAP(space_)) {
    dParallelSAPSpaceSetNumThreads(space_, plan.threads);
    dParallelSAPSpaceSetSkipStatic(space_, plan.ways.skip_static);
    dParallelSAPSpaceSetSkipAsleep(space_, plan.ways.skip_asleep);
    dParallelSAPSpaceSetNotified(space_, plan.ways.notified);
  }
  dRandSetSeed(1);
  addShelves();
  addFloor();
  addBoxes();
  addRobots();
  hits_.resize(rays_.size());
}

Warehouse::~Warehouse() {
  for (const dParallelSAPProbe& probe : probes_) dGeomDestroy(probe.geom);
  dGeomDestroy(ray_);
  dSpaceDestroy(space_);
  dGeomTriMeshDataDestroy(floor_);
  dWorldDestroy(world_);
}

dGeomID Warehouse::add(dGeomID geom, dReal x, dReal y, dReal z) {
  dGeomSetData(geom, reinterpret_cast<void*>(static_cast<std::intptr_t>(geoms_.size())));
  geoms_.push_back(geom);
  dGeomSetPosition(geom, x, y, z);
  if (!plan_.ways.layers) return geom;
  const bool is_static = !dGeomGetBody(geom);
  dGeomSetCategoryBits(geom, is_static ? static_bit : solid_bit);
  // ODE pairs two geoms if either one wants the other, so static ones want nothing.
  dGeomSetCollideBits(geom, is_static ? 0 : static_bit | solid_bit);
  return geom;
}

// A shelf and what lies on it are one box.
void Warehouse::addShelves() {
  for (int i = 0; i < plan_.shelves; ++i) {
    const int place = i / levels;
    const double height = between(0.1, 1.1);
    add(dCreateBox(static_, real(bay), real(depth), real(height)),
        real(edge + bay * (place % columns_ + 0.5)), real(edge + row * (place / columns_)),
        real(level * (i % levels) + height / 2));
  }
}

// Tiles of a row's width, and a ramp behind the last row.
void Warehouse::addFloor() {
  const int across = static_cast<int>((2 * edge + bay * columns_) / row) + 1, along = rows_ + 8;
  for (int i = 0; i < (across + 1) * (along + 1); ++i) {
    const int x = i % (across + 1), y = i / (across + 1);
    for (const double coordinate : {row * x, row * y, 0.4 * std::max(0, y - rows_ - 4)})
      corners_.push_back(static_cast<float>(coordinate));
    const dTriIndex here = static_cast<dTriIndex>(i), above = here + static_cast<dTriIndex>(across);
    if (x < across && y < along)
      triangles_.insert(triangles_.end(), {here, here + 1, above + 2, here, above + 2, above + 1});
  }
  dGeomTriMeshDataBuildSingle(floor_, corners_.data(), 3 * sizeof(float),
                              static_cast<int>(corners_.size() / 3), triangles_.data(),
                              static_cast<int>(triangles_.size()), 3 * sizeof(dTriIndex));
  add(dCreateTriMesh(static_, floor_, nullptr, nullptr, nullptr), 0, 0, 0);
}

dBodyID Warehouse::addBody(double x, double y, double z) {
  const dBodyID body = dBodyCreate(world_);
  dBodySetPosition(body, real(x), real(y), real(z));
  return body;
}

void Warehouse::addBoxes() {
  for (int i = 0; i < box_count; ++i) {
    const dBodyID body = addBody(edge + between(0, bay * columns_),
                                 edge + row * (i % rows_) + between(0.8, 3.2), 0.25);
    dBodyDisable(body);
    const dGeomID geom = dCreateBox(space_, real(0.5), real(0.5), real(0.5));
    dGeomSetBody(geom, body);
    const dReal* const at = dBodyGetPosition(body);
    add(geom, at[0], at[1], at[2]);
  }
}

void Warehouse::addRobots() {
  for (int i = 0; i < robot_count; ++i) {
    robots_.push_back(addBody(0, 0, 0));
    const dSpaceID space = dSimpleSpaceCreate(space_);
    for (const Part& part : parts) {
      const dGeomID geom = create(space, part);
      dGeomSetBody(geom, robots_.back());
      add(geom, 0, 0, 0);
      dGeomSetOffsetPosition(geom, real(part.at[0]), real(part.at[1]), real(part.at[2]));
    }
  }
  for (int i = 0; i < ray_count; ++i) {
    const double angle = i * (2 * M_PI / 360), up = 0.1 * (i % 3 - 1);
    dParallelSAPRay ray = {};
    ray.direction[0] = real(std::cos(up) * std::cos(angle));
    ray.direction[1] = real(std::cos(up) * std::sin(angle));
    ray.direction[2] = real(std::sin(up));
    ray.length = real(lidar_range);
    ray.ignore = robots_[static_cast<std::size_t>(i * robot_count / ray_count)];
    rays_.push_back(ray);
  }
  for (int i = 0; i < probe_count; ++i)
    probes_.push_back({dCreateBox(nullptr, 1, real(0.6), real(1.1)),
                       robots_[static_cast<std::size_t>(i * robot_count / probe_count)], 0});
}

// Robots drive to the end of their aisle, and back.
void Warehouse::driveOn() {
  const double length = bay * columns_;
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    const int number = static_cast<int>(i);
    const double way = std::fmod(0.37 * number * length + way_a_frame * frames_, 2 * length);
    dMatrix3 turned;
    dRFromAxisAndAngle(turned, 0, 0, 1, way < length ? 0 : real(M_PI));
    dBodySetRotation(robots_[i], turned);
    dBodySetPosition(robots_[i], real(edge + std::min(way, 2 * length - way)),
                     real(edge + row * (number * rows_ / robot_count + 0.5)), 0);
  }
  for (dParallelSAPRay& ray : rays_)
    dBodyGetRelPointPos(ray.ignore, real(-0.3), 0, real(lidar_height), ray.origin);
}

// The poses that a robot might take next are those of a grid around it.
void Warehouse::placeProbes() {
  for (int i = 0; i < probe_count; ++i) {
    const dParallelSAPProbe& probe = probes_[static_cast<std::size_t>(i)];
    dMatrix3 turned;
    dRFromAxisAndAngle(turned, 0, 0, 1, real(0.3 * (i % 7)));
    dGeomSetRotation(probe.geom, turned);
    const dReal* const at = dBodyGetPosition(probe.ignore);
    dGeomSetPosition(probe.geom, at[0] + real(0.5 * (i % 10 - 4.5)),
                     at[1] + real(0.6 * (i / 10 % 5 - 2)), real(0.6));
  }
}

const Work& Warehouse::frame() {
  using Clock = std::chrono::steady_clock;
  driveOn();
  ++frames_;
  work_ = {};
  answers_ = {};
  const auto time = [&](int stage, auto&& work) {
    const Clock::time_point begin = Clock::now();
    work();
    work_.ms[static_cast<std::size_t>(stage)] =
        std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  };
  time(Work::Collide, [&] { collide(); });
  time(Work::Lidar, [&] { castRays(); });
  time(Work::Planner, [&] {
    placeProbes();
    tryPoses();
  });
  for (const dParallelSAPRayHit& hit : hits_) work_.hits += hit.geom != nullptr;
  for (const dParallelSAPProbe& probe : probes_) work_.free += probe.touched == 0;
  return work_;
}

Answers Warehouse::answers() {
  for (const dParallelSAPRayHit& hit : hits_)
    answers_.distances.push_back(hit.geom ? hit.distance : -1);
  for (const dParallelSAPProbe& probe : probes_) answers_.free.push_back(probe.touched == 0);
  for (auto* const pairs : {&answers_.pairs, &answers_.touching})
    std::sort(pairs->begin(), pairs->end());
  return std::move(answers_);
}

void Warehouse::collide() {
  if (!plan_.ways.contacts) return dSpaceCollide(space_, this, near);
  const dParallelSAPContactCallbacks callbacks = {report, flagsOf, nullptr, nullptr};
  dParallelSAPSpaceCollideContacts(space_, this, 0, &callbacks);
  dParallelSAPStats stats;
  dParallelSAPSpaceGetStats(space_, &stats);
  work_.pairs = stats.pairs;
}

// A program would make joints of the contacts.
void Warehouse::report(void* data, dGeomID a, dGeomID b, const dContactGeom*, int count) {
  Warehouse& self = *static_cast<Warehouse*>(data);
  self.work_.contacts += static_cast<std::size_t>(count);
  self.answers_.touching.push_back(numbers(a, b));
}

void Warehouse::near(void* data, dGeomID a, dGeomID b) {
  Warehouse& self = *static_cast<Warehouse*>(data);
  ++self.work_.pairs;
  if (!flagsOf(nullptr, a, b)) return;
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) return dSpaceCollide2(a, b, data, near);
  self.answers_.pairs.push_back(numbers(a, b));
  dContactGeom contacts[most_contacts];
  const int count = dCollide(a, b, most_contacts, contacts, sizeof contacts[0]);
  if (count > 0) report(data, a, b, contacts, count);
}

dGeomID Warehouse::aim(std::size_t i) {
  const dParallelSAPRay& ray = rays_[current_ = i];
  const dReal *const at = ray.origin, *const way = ray.direction;
  dGeomRaySet(ray_, at[0], at[1], at[2], way[0], way[1], way[2]);
  hits_[i] = {};
  return ray_;
}

void Warehouse::castRays() {
  if (plan_.ways.rays)
    dParallelSAPSpaceRays(space_, rays_.data(), rays_.size(), 0, hits_.data());
  else
    for (std::size_t i = 0; i < rays_.size(); ++i)
      dSpaceCollide2(aim(i), reinterpret_cast<dGeomID>(space_), this, nearRay);
}

void Warehouse::nearRay(void* data, dGeomID a, dGeomID b) {
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) return dSpaceCollide2(a, b, data, nearRay);
  Warehouse& self = *static_cast<Warehouse*>(data);
  const dGeomID other = a == self.ray_ ? b : a;
  if (dGeomGetBody(other) == self.rays_[self.current_].ignore) return;
  dContactGeom contact;
  dParallelSAPRayHit& hit = self.hits_[self.current_];
  if (!dCollide(self.ray_, other, 1, &contact, sizeof contact)) return;
  if (hit.geom && hit.distance <= contact.depth) return;
  hit.geom = other;
  hit.distance = contact.depth;
}

dGeomID Warehouse::pose(std::size_t i) {
  probes_[current_ = i].touched = 0;
  return probes_[i].geom;
}

void Warehouse::tryPoses() {
  if (plan_.ways.overlaps)
    dParallelSAPSpaceOverlaps(space_, probes_.data(), probes_.size(), sizeof probes_[0],
                              dParallelSAPOverlapAny, nullptr, nullptr);
  else
    for (std::size_t i = 0; i < probes_.size(); ++i)
      dSpaceCollide2(pose(i), reinterpret_cast<dGeomID>(space_), this, nearProbe);
}

void Warehouse::nearProbe(void* data, dGeomID a, dGeomID b) {
  Warehouse& self = *static_cast<Warehouse*>(data);
  dParallelSAPProbe& probe = self.probes_[self.current_];
  if (probe.touched) return;
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) return dSpaceCollide2(a, b, data, nearProbe);
  const dGeomID other = a == probe.geom ? b : a;
  if (dGeomGetBody(other) == probe.ignore) return;
  dContactGeom contact;
  probe.touched = dCollide(probe.geom, other, 1, &contact, sizeof contact) > 0;
}

}  // namespace scene
