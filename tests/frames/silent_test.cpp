// Meshes whose triangles change without a word to any space: dGeomTriMeshSetData tells none. And
// all other changes, each followed at once by every call.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <array>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/not_finite.h"
#include "support/random.h"
#include "support/ray_oracle.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

constexpr std::size_t kProbeNumber = 1000000;
constexpr std::size_t kPlaces = 8;

// Where the triangle of data number `place` is: from x to x + 1. Boxes of denseCube() are not
// there.
double xOf(std::size_t place) {
  return 100 + 10 * static_cast<double>(place);
}

// One triangle at each place.
class Triangles {
 public:
  Triangles() {
    static const dTriIndex indices[] = {0, 1, 2};
    for (std::size_t place = 0; place < kPlaces; ++place) {
      const double x = xOf(place);
      vertices_[place] = {x, 0, 0, x + 1, 0, 0, x, 1, 1};
      data_[place] = dGeomTriMeshDataCreate();
      dGeomTriMeshDataBuildDouble(data_[place], vertices_[place].data(), 3 * sizeof(double), 3,
                                  indices, 3, 3 * sizeof(dTriIndex));
    }
  }
  ~Triangles() {
    for (const dTriMeshDataID data : data_) dGeomTriMeshDataDestroy(data);
  }
  Triangles(const Triangles&) = delete;
  Triangles& operator=(const Triangles&) = delete;

  dTriMeshDataID at(std::size_t place) const { return data_[place]; }
  dGeomID create(dSpaceID space, std::size_t place) const {
    return dCreateTriMesh(space, data_[place], nullptr, nullptr, nullptr);
  }

 private:
  std::array<std::array<double, 9>, kPlaces> vertices_;
  std::array<dTriMeshDataID, kPlaces> data_;
};

// The space in which a mesh is put, and what of it the outer space reports.
struct Holder {
  const char* name;
  dSpaceID (*outermost)(dSpaceID parent);  // null: the outer space itself
  dSpaceID (*innermost)(dSpaceID parent);  // null: that
};
const Holder kHolders[] = {{"none", nullptr, nullptr},
                           {"simple", dSimpleSpaceCreate, nullptr},
                           {"hash", dHashSpaceCreate, nullptr},
                           {"ours", dParallelSAPSpaceCreate, nullptr},
                           {"simple in hash", dHashSpaceCreate, dSimpleSpaceCreate},
                           {"simple in ours", dParallelSAPSpaceCreate, dSimpleSpaceCreate},
                           {"ours in simple", dSimpleSpaceCreate, dParallelSAPSpaceCreate},
                           {"ours in ours", dParallelSAPSpaceCreate, dParallelSAPSpaceCreate}};

std::vector<std::size_t> numbersAt(dSpaceID space, std::size_t place) {
  const dGeomID probe = dCreateBox(nullptr, 2, 2, 2);
  dGeomSetPosition(probe, static_cast<dReal>(xOf(place) + 0.5), 0, 0);
  setNumber(probe, kProbeNumber);
  std::vector<std::size_t> numbers;
  for (const Pair& pair : collide2(space, probe)) numbers.push_back(pair.first);
  dGeomDestroy(probe);
  return numbers;
}

}  // namespace

TEST_CASE("A mesh with other triangles pairs where these are, in whatever space it is",
          "[silent]") {
  const Triangles triangles;
  for (const Configuration& configuration : configurations())
    for (const Holder& holder : kHolders)
      for (const std::size_t n : {0, 300, 1500}) {
        const Space space(configuration);
        World world(space);
        world.addBoxes(denseCube(n, 2));
        const dSpaceID outermost = holder.outermost ? holder.outermost(space) : dSpaceID(space);
        const dSpaceID innermost = holder.innermost ? holder.innermost(outermost) : outermost;
        const dGeomID mesh = triangles.create(innermost, 0);
        setNumber(outermost == space ? mesh : asGeom(outermost), kProbeNumber);
        for (std::size_t place = 0; place < kPlaces; ++place) {
          const dGeomID box = world.take(dCreateBox(space, 2, 2, 2));
          dGeomSetPosition(box, static_cast<dReal>(xOf(place)), 0, 0);
        }
        const auto partners = [&] {
          std::vector<std::size_t> partners;
          for (const Pair& pair : collide(space))
            if (pair.first == kProbeNumber) partners.push_back(pair.second - n);
          return partners;
        };
        for (int frame = 0; frame < 4; ++frame) REQUIRE(partners() == std::vector<std::size_t>{0});
        for (std::size_t round = 1; round < 2 * kPlaces; ++round) {
          INFO(configuration.name << ", in " << holder.name << ", " << n << " boxes, round "
                                  << round);
          const std::size_t place = round * 3 % kPlaces;
          dGeomTriMeshSetData(mesh, triangles.at(place));
          if (round % 3 == 1 && dSpaceIsParallelSAP(innermost)) dSpaceClean(innermost);
          CHECK(partners() == std::vector<std::size_t>{place});
          CHECK(partners() == std::vector<std::size_t>{place});
        }
      }
}

TEST_CASE("A space that is the geom of a query brings its meshes up to date first", "[silent]") {
  const Triangles triangles;
  const Space space, other;
  dSpaceSetSublevel(space, 1);  // so that its geoms meet the other space as one geom
  dGeomSetPosition(dCreateBox(space, 2, 2, 2), static_cast<dReal>(xOf(1)), 0, 0);
  const dGeomID mesh = triangles.create(other, 0);
  CHECK(collide2(space, other.geom()).empty());
  dGeomTriMeshSetData(mesh, triangles.at(1));
  CHECK(collide2(space, other.geom()).size() == 1);
}

TEST_CASE("Spaces are asked for the meshes they hold as these come and go", "[silent]") {
  const std::uint64_t seed = seedOr(301);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  const Triangles triangles;
  Random random(seed);
  const Space space;
  struct Model {
    dSpaceID outermost, innermost;
    std::vector<std::pair<dGeomID, std::size_t>> meshes;  // with their places
    std::size_t number;
  };
  std::vector<Model> models;
  std::size_t numbers = 0;
  const auto edit = [&] {
    Model* const model = models.empty() ? nullptr : &models[random.below(models.size())];
    const std::size_t place = random.below(kPlaces);
    switch (random.below(model ? 7 : 1)) {
      case 0: {
        const Holder& holder = kHolders[1 + random.below(7)];
        const dSpaceID outermost = holder.outermost(space);
        setNumber(asGeom(outermost), ++numbers);
        models.push_back(
            {outermost, holder.innermost ? holder.innermost(outermost) : outermost, {}, numbers});
        break;
      }
      case 1:
      case 2:
        model->meshes.emplace_back(triangles.create(model->innermost, place), place);
        break;
      case 3:
        if (random.chance(0.7)) break;
        dSpaceDestroy(model->outermost);
        models.erase(models.begin() + (model - models.data()));
        break;
      case 4:
        if (model->meshes.empty()) break;
        dGeomDestroy(model->meshes.back().first);
        model->meshes.pop_back();
        break;
      default:
        if (model->meshes.empty()) break;
        std::pair<dGeomID, std::size_t>& mesh = model->meshes[random.below(model->meshes.size())];
        dGeomTriMeshSetData(mesh.first, triangles.at(mesh.second = place));
    }
  };
  const auto reaches = [](const Model& model, std::size_t place) {
    if (model.meshes.empty()) return false;
    const auto [least, most] =
        std::minmax_element(model.meshes.begin(), model.meshes.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; });
    return least->second <= place && place <= most->second;
  };
  const int edits = scaled(4000);
  for (int i = 0; i < edits; ++i) {
    edit();
    if (random.chance(0.4)) continue;
    if (random.chance(0.1)) (void)collide(space);
    if (random.chance(0.1)) dSpaceClean(space);
    if (random.chance(0.2) && !models.empty() && dSpaceIsParallelSAP(models.back().innermost))
      dSpaceClean(models.back().innermost);
    const std::size_t place = random.below(kPlaces);
    std::vector<std::size_t> expected;
    for (const Model& model : models)
      if (reaches(model, place)) expected.push_back(model.number);
    INFO("edit " << i);
    REQUIRE(numbersAt(space, place) == expected);
  }
}

namespace {

// A way in which a geom comes to its lane, at x = xOf(0), and leaves it.
struct Visitor {
  std::string name;
  dGeomID reported;  // the geom itself, or the space of the outer space that it is in
  std::function<void(Visitor& self, bool here)> come;
  bool is_here = false;
  bool by_speed = false;  // only while bounds are swept
};

dReal laneOf(std::size_t lane) {
  return 20 * static_cast<dReal>(lane);
}
dReal placeOf(bool here) {
  return real(xOf(here ? 0 : kPlaces - 1));
}

// Rays have bits that hosts have not. Of 64 bits, those above are above the 32nd.
constexpr unsigned long kUpperBit = 1ul << (8 * sizeof(long) - 24);
constexpr unsigned long kHostBits = 1 | kUpperBit, kRayBits = 2 | 2 * kUpperBit;
std::size_t boxes_asked_by_rays;  // as bits of lanes: no collider tells of user boxes

// In each lane a visitor, a host in the outer space that it pairs with, a probe, and a ray.
class Lanes {
 public:
  Lanes(dSpaceID space, dWorldID world, const Triangles& triangles)
      : space_(space), world_(world), triangles_(triangles) {
    sweep(true);
    addDirect();
    for (const Holder& holder : kHolders) {
      const dSpaceID outermost = holder.outermost ? holder.outermost(space) : space;
      const dSpaceID innermost = holder.innermost ? holder.innermost(outermost) : outermost;
      const dGeomID mesh = triangles_.create(innermost, 0);
      add("other triangles, holder " + std::string(holder.name),
          holder.outermost ? asGeom(outermost) : mesh, [this, mesh](Visitor&, bool here) {
            dGeomTriMeshSetData(mesh, triangles_.at(here ? 0 : kPlaces - 1));
          });
      dGeomSetPosition(mesh, 0, laneOf(visitors.size() - 1), 0);
      if (!holder.outermost) continue;
      const dSpaceID around = holder.outermost(space);
      const dGeomID inside = dCreateSphere(holder.innermost ? holder.innermost(around) : around, 1);
      add("moves, holder " + std::string(holder.name), asGeom(around), mover(inside));
    }
    for (std::size_t lane = 0; lane < visitors.size(); ++lane) {
      visitors[lane].come(visitors[lane], false);
      hosts_.push_back(dCreateBox(space, 2, 2, 2));
      probes_.push_back(dCreateBox(nullptr, 2, 2, 2));
      for (const dGeomID geom : {hosts_[lane], probes_[lane]}) {
        dGeomSetPosition(geom, placeOf(true), laneOf(lane), 0);
        setNumber(geom, kHosts + lane);
        dGeomSetCategoryBits(geom, kHostBits);
        dGeomSetCollideBits(geom, kHostBits);
      }
      // More of them than it takes to keep a tree.
      for (int i = 0; i < 8; ++i) rays_.push_back(rayIn(lane));
    }
  }
  ~Lanes() {
    for (const dGeomID probe : probes_) dGeomDestroy(probe);
    for (const Visitor& visitor : visitors)
      if (!dGeomGetSpace(visitor.reported)) dGeomDestroy(visitor.reported);
  }
  Lanes(const Lanes&) = delete;
  Lanes& operator=(const Lanes&) = delete;

  static constexpr std::size_t kCalls = 7;
  // The lanes of whose visitors a call tells, and nothing twice.
  std::set<std::size_t> told(std::size_t call) {
    std::set<std::size_t> lanes;
    const auto tell = [&](std::size_t lane) { REQUIRE(lanes.insert(lane).second); };
    switch (call) {
      case 0:
      case 1:
      case 2: {
        for (const auto& [a, b] : collideBy(call)) {
          const std::size_t visitor = std::min(a, b), host = std::max(a, b);
          if (visitor >= kVisitors && host >= kHosts) tell(host - kHosts);
          if (visitor >= kVisitors && host >= kHosts) REQUIRE(visitor - kVisitors == host - kHosts);
        }
        break;
      }
      case 3:
      case 4:
        ++next_;
        for (std::size_t i = 0; i < visitors.size(); ++i) {
          const std::size_t lane = (i + next_) % visitors.size();
          for (const auto& [a, b] : call == 3 ? collide2(space_, probes_[lane])
                                              : collide2(probes_[lane], asGeom(space_)))
            if (std::min(a, b) == kVisitors + lane) tell(lane);
        }
        break;
      default: {
        boxes_asked_by_rays = 0;
        std::set<std::size_t> hit;
        if (call == 5) {
          const RayHits hits = nearestHits(space_, rays_, 0);
          for (std::size_t i = 0; i < hits.size(); ++i)
            if (hits[i].geom) hit.insert(i / 8);
        } else {
          const std::vector<RayHits> hits = allHits(space_, rays_, 0);
          for (std::size_t i = 0; i < hits.size(); ++i)
            if (!hits[i].empty()) hit.insert(i / 8);
        }
        lanes = hit;
        for (std::size_t lane = 0; lane < visitors.size(); ++lane)
          if (boxes_asked_by_rays >> lane & 1) tell(lane);
      }
    }
    return lanes;
  }
  std::set<std::size_t> here() const {
    std::set<std::size_t> lanes;
    for (std::size_t lane = 0; lane < visitors.size(); ++lane)
      if (visitors[lane].is_here && (swept_ || !visitors[lane].by_speed)) lanes.insert(lane);
    return lanes;
  }
  void sweep(bool on) {
    swept_ = on;
    dParallelSAPSpaceSetSweptBounds(space_, on ? 1 : 0);
  }
  bool isSwept() const { return swept_; }

  std::vector<Visitor> visitors;

 private:
  using Come = std::function<void(Visitor&, bool)>;
  static constexpr std::size_t kVisitors = 2 * kProbeNumber, kHosts = 3 * kProbeNumber;

  void add(const std::string& name, dGeomID reported, const Come& come) {
    setNumber(reported, kVisitors + visitors.size());
    visitors.push_back({name, reported, come});
  }
  // One that is always in its place.
  dGeomID ball() {
    const dGeomID geom = dCreateSphere(space_, 1);
    dGeomSetPosition(geom, placeOf(true), laneOf(visitors.size()), 0);
    return geom;
  }
  Come mover(dGeomID geom) {
    const std::size_t lane = visitors.size();
    return [=](Visitor&, bool here) { dGeomSetPosition(geom, placeOf(here), laneOf(lane), 0); };
  }
  // Its box reaches its place while it is fast and awake.
  dGeomID fastBox(dBodyID body, dReal speed) {
    const Bounds unit = {-1, 1, -1, 1, -1, 1};
    const auto noteRay = [](dGeomID self, dGeomID other, dReal*) {
      if (dGeomGetClass(other) == dRayClass)
        boxes_asked_by_rays |= std::size_t{1} << (number(self) - kVisitors);
      return 1;
    };
    const dGeomID geom = createUserBox(space_, unit, true, noteRay);
    dGeomSetBody(geom, body);
    dBodySetPosition(body, placeOf(true) - 10, laneOf(visitors.size()), 0);
    dBodySetLinearVel(body, speed, 0, 0);
    return geom;
  }

  void addDirect() {
    add("moves", dCreateSphere(space_, 1), nullptr);
    visitors.back().come = [](Visitor& self, bool here) {
      dGeomSetPosition(self.reported, placeOf(here), 0, 0);
    };
    const dBodyID body = dBodyCreate(world_);
    const std::size_t lane = visitors.size();
    add("moves with its body", dCreateSphere(space_, 1),
        [=](Visitor&, bool here) { dBodySetPosition(body, placeOf(here), laneOf(lane), 0); });
    dGeomSetBody(visitors.back().reported, body);
    add("is enabled", ball(), [](Visitor& self, bool here) {
      here ? dGeomEnable(self.reported) : dGeomDisable(self.reported);
    });
    add("gets bits", ball(), [](Visitor& self, bool here) {
      dGeomSetCategoryBits(self.reported, here ? ~0ul : 0);
      dGeomSetCollideBits(self.reported, here ? ~0ul : 0);
    });
    add("gets other upper bits", ball(), [](Visitor& self, bool here) {
      dGeomSetCategoryBits(self.reported, kUpperBit * (here ? 3 : 4));
      dGeomSetCollideBits(self.reported, kUpperBit * (here ? 3 : 4));
    });
    add("grows", ball(),
        [](Visitor& self, bool here) { dGeomSphereSetRadius(self.reported, here ? 1 : 0); });
    add("is a number", ball(), [at = visitors.size()](Visitor& self, bool here) {
      dGeomSetPosition(self.reported, here ? placeOf(true) : kNaN, laneOf(at), 0);
    });
    add("is added", ball(), [this](Visitor& self, bool here) {
      if (here == (dGeomGetSpace(self.reported) != nullptr)) return;
      here ? dSpaceAdd(space_, self.reported) : dSpaceRemove(space_, self.reported);
    });
    add("is another", ball(), [this, at = visitors.size()](Visitor& self, bool here) {
      dGeomDestroy(self.reported);
      self.reported = dCreateSphere(space_, 1);
      setNumber(self.reported, kVisitors + at);
      dGeomSetPosition(self.reported, placeOf(here), laneOf(at), 0);
    });
    const dBodyID pushed = dBodyCreate(world_), woken = dBodyCreate(world_);
    add("has another speed", fastBox(pushed, 0),
        [=](Visitor&, bool here) { dBodySetLinearVel(pushed, here ? 10 : 0, 0, 0); });
    add("wakes", fastBox(woken, 10),
        [=](Visitor&, bool here) { here ? dBodyEnable(woken) : dBodyDisable(woken); });
    for (std::size_t i = 1; i <= 2; ++i) visitors[visitors.size() - i].by_speed = true;
  }

  static dParallelSAPRay rayIn(std::size_t lane) {
    dParallelSAPRay ray = rayOf({xOf(0) + 0.3, laneOf(lane) + 0.25, 5}, {0, 0, -1}, 10);
    ray.category_bits = ray.collide_bits = kRayBits;
    return ray;
  }

  Pairs collideBy(std::size_t call) {
    Pairs pairs;
    if (call == 0) return collide(space_);
    if (call == 1) {
      const auto take = [](void* pairs, const dParallelSAPPair* some, std::size_t count,
                           std::size_t) {
        for (std::size_t i = 0; i < count; ++i) record(pairs, some[i].o1, some[i].o2);
      };
      dParallelSAPSpaceCollidePairs(space_, &pairs, 0, take);
      return pairs;
    }
    const auto ignore = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
    const auto flags = [](void* pairs, dGeomID a, dGeomID b) {
      record(pairs, a, b);
      return 0;
    };
    const auto spaces = [](void* pairs, dGeomID a, dGeomID b, void*) { record(pairs, a, b); };
    const dParallelSAPContactCallbacks callbacks = {ignore, flags, nullptr, spaces};
    dParallelSAPSpaceCollideContacts(space_, &pairs, 0, &callbacks);
    return pairs;
  }

  const dSpaceID space_;
  const dWorldID world_;
  const Triangles& triangles_;
  std::vector<dGeomID> hosts_, probes_;
  Rays rays_;
  std::size_t next_ = 0;
  bool swept_ = false;
};

}  // namespace

TEST_CASE("Every call sees every kind of change that came right before it", "[silent]") {
  const Triangles triangles;
  for (const std::size_t n : {0, 300}) {
    const std::uint64_t seed = seedOr(311 + n);
    Random random(seed);
    const dWorldID dynamics = dWorldCreate();
    {
      const Space space, other;
      setNumber(dCreateSphere(other, 1), 0);
      dParallelSAPSpaceSetNumThreads(space, 1);
      Lanes lanes(space, dynamics, triangles);
      World world(space);
      world.addBoxes(denseCube(n, seed));
      std::size_t last = 0;
      for (int step = 0; step < scaled(1500); ++step) {
        // Those of this step; some at once, some after others.
        for (std::size_t changes = random.below(4); changes > 0; --changes) {
          last = random.below(lanes.visitors.size());
          Visitor& visitor = lanes.visitors[last];
          visitor.is_here = !visitor.is_here;
          visitor.come(visitor, visitor.is_here);
        }
        if (random.chance(0.05)) world.jitter(0.1, random.bits());
        if (random.chance(0.05)) dSpaceClean(space);
        if (random.chance(0.1)) lanes.sweep(!lanes.isSwept());
        // Another space may be the first to have a geom brought up to date.
        if (random.chance(0.3)) (void)collide2(other, lanes.visitors[last].reported);
        const std::size_t call = random.below(Lanes::kCalls);
        INFO(n << " boxes, step " << step << ", call " << call << ", last: "
               << lanes.visitors[last].name << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        REQUIRE(lanes.told(call) == lanes.here());
      }
    }
    dWorldDestroy(dynamics);
  }
}

namespace {

// Down to pairs of geoms.
void recordWithin(void* pairs, dGeomID a, dGeomID b) {
  if (dGeomIsSpace(a) || dGeomIsSpace(b))
    dSpaceCollide2(a, b, pairs, recordWithin);
  else
    record(pairs, a, b);
}

}  // namespace

// Stock spaces clean only what is in front of their lists, and ODE asserts that callbacks find all
// boxes up to date.
TEST_CASE("What stock sub-spaces leave dirty makes none of them dirty in callbacks", "[silent]") {
  const Triangles triangles;
  for (const bool destroyed : {false, true}) {
    const Space space;
    const dSpaceID stock = dSimpleSpaceCreate(space), ours = dParallelSAPSpaceCreate(stock),
                   inner = dSimpleSpaceCreate(ours);
    const dGeomID mesh = triangles.create(inner, 0);
    setNumber(mesh, 0);
    (void)dCreateSphere(inner, 1);
    const dGeomID mover = dCreateSphere(inner, 1), front = dCreateSphere(stock, 1);
    for (const std::size_t i : {1, 2}) {  // beside each other
      const dGeomID box = dCreateBox(space, 2, 2, 2);
      dGeomSetPosition(box, placeOf(true), real(2.5 * static_cast<double>(i) - 3.25), 0);
      setNumber(box, i);
    }
    (void)collide(space);
    dGeomTriMeshSetData(mesh, triangles.at(0));
    dGeomSetPosition(destroyed ? mesh : mover, 0, 0, 0);
    destroyed ? dGeomDestroy(mesh) : dGeomSetPosition(front, 0, 0, 0);
    Pairs pairs;
    dSpaceCollide(space, &pairs, recordWithin);
    CHECK(asSet(pairs) == (destroyed ? Pairs() : Pairs{{0, 1}, {0, 2}}));
  }
}
