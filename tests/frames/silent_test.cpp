// Meshes whose triangles change without a word to any space: dGeomTriMeshSetData tells none. And
// all other changes, each followed at once by every call.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <array>
#include <functional>
#include <set>
#include <string>
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

// Where a visitor is while it is here, or not. Boxes of denseCube() are not there.
double xOf(bool here) {
  return here ? 100 : 170;
}

dReal placeOf(bool here) {
  return real(xOf(here));
}

// One triangle at each place, from x to x + 1.
class Triangles {
 public:
  Triangles() {
    static const dTriIndex indices[] = {0, 1, 2};
    for (const bool place : {false, true}) {
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

  dTriMeshDataID at(bool place) const { return data_[place]; }
  dGeomID create(dSpaceID space, bool place) const {
    return dCreateTriMesh(space, data_[place], nullptr, nullptr, nullptr);
  }

 private:
  std::array<double, 9> vertices_[2];
  dTriMeshDataID data_[2];
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

}  // namespace

TEST_CASE("A space that is the geom of a query brings its meshes up to date first", "[silent]") {
  const Triangles triangles;
  const Space space, other;
  dSpaceSetSublevel(space, 1);  // so that its geoms meet the other space as one geom
  dGeomSetPosition(dCreateBox(space, 2, 2, 2), placeOf(true), 0, 0);
  const dGeomID mesh = triangles.create(other, false);
  CHECK(collide2(space, other.geom()).empty());
  dGeomTriMeshSetData(mesh, triangles.at(true));
  CHECK(collide2(space, other.geom()).size() == 1);
}

namespace {

// A way in which a geom comes to its lane, at x = xOf(true), and leaves it.
struct Visitor {
  std::string name;
  dGeomID reported;  // the geom itself, or the space of the outer space that it is in
  std::function<void(Visitor& self, bool here)> come;
  bool is_here = false;
  bool by_speed = false;  // only while bounds are swept
  std::size_t times = 0;  // that it left
};

dReal laneOf(std::size_t lane) {
  return 20 * static_cast<dReal>(lane);
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
      const std::string held = std::string(", holder ") + holder.name;
      const dSpaceID outermost = createIn(holder);
      const dGeomID mesh = triangles_.create(innermostOf(holder, outermost), false);
      add("other triangles" + held, holder.outermost ? asGeom(outermost) : mesh,
          [this, mesh](Visitor&, bool here) { dGeomTriMeshSetData(mesh, triangles_.at(here)); });
      dGeomSetPosition(mesh, 0, laneOf(visitors.size() - 1), 0);
      if (!holder.outermost) continue;
      const dSpaceID around = createIn(holder);
      add("moves" + held, asGeom(around), mover(dCreateSphere(innermostOf(holder, around), 1)));
      add("comes, and goes with its space at times" + held, asGeom(createIn(holder)),
          [this, &holder, lane = visitors.size()](Visitor& self, bool here) {
            comeOrGo(self, holder, lane, here);
          });
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
  static constexpr std::size_t kVisitors = 2000000, kHosts = 3000000;

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
  dSpaceID createIn(const Holder& holder) const {
    const dSpaceID outermost = holder.outermost ? holder.outermost(space_) : space_;
    if (holder.innermost) holder.innermost(outermost);
    return outermost;
  }
  static dSpaceID innermostOf(const Holder& holder, dSpaceID outermost) {
    return holder.innermost ? dSpaceID(dSpaceGetGeom(outermost, 0)) : outermost;
  }
  // A mesh whose triangles were elsewhere before; every other time its spaces are others.
  void comeOrGo(Visitor& self, const Holder& holder, std::size_t lane, bool here) const {
    const dSpaceID outermost = dSpaceID(self.reported), space = innermostOf(holder, outermost);
    if (here) {
      const dGeomID mesh = triangles_.create(space, false);
      dGeomSetPosition(mesh, 0, laneOf(lane), 0);
      if (self.times % 3 == 0) (void)collide(space_);
      dGeomTriMeshSetData(mesh, triangles_.at(true));
    } else if (++self.times % 2) {
      dSpaceDestroy(outermost);
      self.reported = asGeom(createIn(holder));
      setNumber(self.reported, kVisitors + lane);
    } else if (dSpaceGetNumGeoms(space) > 0) {
      dGeomDestroy(dSpaceGetGeom(space, 0));
    }
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
    dParallelSAPRay ray = rayOf({xOf(true) + 0.3, laneOf(lane) + 0.25, 5}, {0, 0, -1}, 10);
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
    const dGeomID mesh = triangles.create(inner, false);
    setNumber(mesh, 0);
    (void)dCreateSphere(inner, 1);
    const dGeomID mover = dCreateSphere(inner, 1), front = dCreateSphere(stock, 1);
    for (const std::size_t i : {1, 2}) {  // beside each other
      const dGeomID box = dCreateBox(space, 2, 2, 2);
      dGeomSetPosition(box, placeOf(true), real(2.5 * static_cast<double>(i) - 3.25), 0);
      setNumber(box, i);
    }
    (void)collide(space);
    dGeomTriMeshSetData(mesh, triangles.at(true));
    dGeomSetPosition(destroyed ? mesh : mover, 0, 0, 0);
    destroyed ? dGeomDestroy(mesh) : dGeomSetPosition(front, 0, 0, 0);
    Pairs pairs;
    dSpaceCollide(space, &pairs, recordWithin);
    CHECK(asSet(pairs) == (destroyed ? Pairs() : Pairs{{0, 1}, {0, 2}}));
  }
}
