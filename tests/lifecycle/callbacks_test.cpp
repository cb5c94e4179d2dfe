// Callbacks that destroy, remove, add and move geoms of the space that calls them.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/oracle.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

enum Way { kNear, kBlocks, kContacts, kQuery, kOwnQuery, kRays, kOverlaps, kWays };

// What is reported at once: pairs of numbers, or of rays the ray and the number of a geom.
using Batch = std::vector<Pair>;
using Take = std::function<void(const Batch& batch, std::size_t first)>;
constexpr std::size_t kNobody = ~std::size_t{0};  // the place is not known

struct Stop {};

// Geoms of a space and of its sub-spaces, by numbers that no two ever have.
class Scene {
 public:
  Scene(const Configuration& configuration, std::size_t n, Random& random)
      : random_(random), space_(configuration), side_(0.8 * std::cbrt(static_cast<double>(n))) {
    probe_ = dCreateBox(nullptr, 2 * dReal(side_), 2 * dReal(side_), 2 * dReal(side_));
    setNumber(probe_, next_++);
    for (dSpaceID (*create)(dSpaceID) :
         {dSimpleSpaceCreate, dHashSpaceCreate, dParallelSAPSpaceCreate})
      if (random_.chance(0.6)) {
        spaces_.push_back(create(space_));
        note(asGeom(spaces_.back()), space_);
      }
    for (std::size_t i = 0; i < n; ++i) create();
    if (random_.chance(0.5)) note(dCreatePlane(space_, 0, 0, 1, 1), space_);
  }
  ~Scene() {
    dGeomDestroy(probe_);
    for (const dGeomID geom : loose_) dGeomDestroy(geom);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  dSpaceID space() const { return space_; }
  Pairs owed() const { return expectedPairs(order_); }

  // Moves no geom, but makes some of them dirty.
  void touch() {
    const double share = random_.chance(0.3) ? 1 : random_.unit() * random_.unit();
    for (const dGeomID geom : order_) {
      if (dGeomIsSpace(geom) || dGeomGetClass(geom) == dPlaneClass || !random_.chance(share))
        continue;
      const dReal* const at = dGeomGetPosition(geom);
      dGeomSetPosition(geom, at[0], at[1], at[2]);
    }
  }

  // One call of this kind.
  void call(Way way, const Take& take) const {
    Take taker = take;
    const dNearCallback* const near = [](void* data, dGeomID a, dGeomID b) {
      (*static_cast<Take*>(data))({{number(a), number(b)}}, kNobody);
    };
    dParallelSAPContactCallbacks contacts = {};
    contacts.contacts = [](void* data, dGeomID a, dGeomID b, const dContactGeom*, int) {
      (*static_cast<Take*>(data))({{number(a), number(b)}}, kNobody);
    };
    std::vector<dParallelSAPRay> rays;
    dParallelSAPProbe one = {probe_, nullptr, 0};
    switch (way) {
      case kNear:
        return dSpaceCollide(space_, &taker, near);
      case kBlocks:
        return dParallelSAPSpaceCollidePairs(
            space_, &taker, 0,
            [](void* data, const dParallelSAPPair* pairs, size_t count, size_t first) {
              Batch batch;
              for (size_t i = 0; i < count; ++i)
                batch.emplace_back(number(pairs[i].o1), number(pairs[i].o2));
              (*static_cast<Take*>(data))(batch, first);
            });
      case kContacts:
        return dParallelSAPSpaceCollideContacts(space_, &taker, 2, &contacts);
      case kQuery:
        return dSpaceCollide2(asGeom(space_), probe_, &taker, near);
      case kOwnQuery:
        return dSpaceCollide2(asGeom(space_), own_probe_, &taker, near);
      case kOverlaps:
        dParallelSAPSpaceOverlaps(
            space_, &one, 1, sizeof one, 2, &taker,
            [](void* data, size_t probe, dGeomID geom, const dContactGeom*, int) {
              (*static_cast<Take*>(data))({{probe, number(geom)}}, kNobody);
            });
        return;
      default:
        for (int i = 0; i < 40; ++i)
          rays.push_back({{dReal(-1), dReal(side_ * i / 40), dReal(side_ / 2)},
                          {1, dReal(0.1), 0},
                          dReal(2 * side_),
                          ~0ul,
                          ~0ul,
                          nullptr});
        dParallelSAPSpaceRayHits(
            space_, rays.data(), rays.size(), 3, &taker,
            [](void* data, size_t ray, const dParallelSAPRayHit* hits, size_t count) {
              Batch batch;
              for (size_t i = 0; i < count; ++i) batch.emplace_back(ray, number(hits[i].geom));
              (*static_cast<Take*>(data))(batch, kNobody);
            });
    }
  }

  void chooseProbe() {
    const auto at = anyLeaf();
    const bool is_own =
        at != parents_.end() && at->second == space_ && !dGeomIsSpace(geoms_.at(at->first));
    own_probe_ = is_own ? geoms_.at(at->first) : probe_;
  }

  // A call is to be changed from within.
  void begin() { gone_.clear(); }
  bool isGone(std::size_t number) const { return gone_.count(number) != 0; }

  // What a callback does. `in_pair`: of a geom that was just reported.
  void change(std::size_t in_pair) {
    const bool all = !odeHasAssertions();
    const auto at = random_.chance(0.5) ? parents_.find(in_pair) : anyLeaf();
    if (at == parents_.end() || dGeomIsSpace(geoms_.at(at->first))) return;
    const dGeomID geom = geoms_.at(at->first);
    switch (random_.below(all ? 8 : 4)) {
      case 0:
      case 1:
        forget(geom);
        dGeomDestroy(geom);
        if (random_.chance(0.5)) create(/*anywhere=*/all);  // often at the same address
        break;
      case 2:
        create(all);
        break;
      case 3:
        if (!spaces_.empty() && random_.chance(0.05)) {
          destroySpace();
        } else {
          INFO("a collide within the callback");
          REQUIRE(difference(collide(space_), owed()) == "");
        }
        break;
      case 4:
      case 5: {
        const dSpaceID parent = at->second;
        forget(geom);
        dSpaceRemove(parent, geom);
        if (random_.chance(0.5)) {
          dSpaceAdd(space_, geom);
          note(geom, space_);
        } else {
          loose_.push_back(geom);
        }
        break;
      }
      default:
        if (dGeomGetClass(geom) != dPlaneClass) place(geom);
    }
  }

 private:
  void place(dGeomID geom) {
    dGeomSetPosition(geom, dReal(random_.between(0, side_)), dReal(random_.between(0, side_)),
                     dReal(random_.between(0, side_)));
  }
  void create(bool anywhere = true) {
    const bool within = !spaces_.empty() && random_.chance(anywhere ? 0.3 : 1);
    if (!within && !anywhere) return;
    const dSpaceID space = within ? spaces_[random_.below(spaces_.size())] : dSpaceID(space_);
    const bool user = !within && random_.chance(0.02);
    const dGeomID geom = user ? createUserBox(space, {0, 1, 0, 1, 0, 1}, true)
                              : dCreateSphere(space, dReal(random_.between(0.3, 0.7)));
    place(geom);
    note(geom, space);
  }
  void note(dGeomID geom, dSpaceID parent) {
    setNumber(geom, next_++);
    geoms_[number(geom)] = geom;
    parents_[number(geom)] = parent;
    if (parent == space_) order_.push_back(geom);
  }
  void forget(dGeomID geom) {
    gone_.insert(number(geom));
    geoms_.erase(number(geom));
    parents_.erase(number(geom));
    order_.erase(std::remove(order_.begin(), order_.end(), geom), order_.end());
  }
  std::map<std::size_t, dSpaceID>::iterator anyLeaf() {
    const auto at = parents_.lower_bound(random_.below(next_));
    return at;
  }
  void destroySpace() {
    const std::size_t i = random_.below(spaces_.size());
    const dSpaceID space = spaces_[i];
    spaces_.erase(spaces_.begin() + static_cast<std::ptrdiff_t>(i));
    std::vector<dGeomID> within;
    for (const auto& [own, parent] : parents_)
      if (parent == space) within.push_back(geoms_.at(own));
    for (const dGeomID geom : within) forget(geom);
    forget(asGeom(space));
    dSpaceDestroy(space);
  }

  Random& random_;
  const Space space_;
  const double side_;
  std::size_t next_ = 1;
  dGeomID probe_, own_probe_ = nullptr;
  std::vector<dSpaceID> spaces_;
  std::vector<dGeomID> order_, loose_;  // the space's, in the order of adding; in no space
  std::map<std::size_t, dGeomID> geoms_;
  std::map<std::size_t, dSpaceID> parents_;
  std::set<std::size_t> gone_;  // in the call that runs
};

// What a call reports must be what it would have without changes, less the pairs of what has left.
void checkCall(Scene& scene, Way way, Random& random) {
  scene.chooseProbe();
  Batch all;
  scene.call(way, [&](const Batch& batch, std::size_t) {
    all.insert(all.end(), batch.begin(), batch.end());
  });
  scene.touch();
  scene.begin();
  const double share = random.chance(0.5) ? 0.5 : 10 / (10 + static_cast<double>(all.size()));
  const bool throws = random.chance(0.1);
  std::size_t next = 0, calls = 0;
  const auto isGone = [&](const Pair& pair) {
    return scene.isGone(pair.second) || (way < kRays && scene.isGone(pair.first));
  };
  const auto take = [&](const Batch& batch, std::size_t first) {
    for (const Pair& pair : batch) {
      INFO("pair " << pair.first << ", " << pair.second << ", call " << calls);
      while (next < all.size() && isGone(all[next])) ++next;
      REQUIRE(next < all.size());
      INFO("instead of " << all[next].first << ", " << all[next].second);
      REQUIRE(all[next] == pair);
      if (first != kNobody) REQUIRE(first++ == next);
      ++next;
    }
    ++calls;
    while (random.chance(share)) scene.change(batch[random.below(batch.size())].second);
    if (throws && random.chance(share)) throw Stop();
  };
  try {
    scene.call(way, take);
    REQUIRE(std::all_of(all.begin() + static_cast<std::ptrdiff_t>(next), all.end(), isGone));
  } catch (const Stop&) {
  }
  REQUIRE(difference(collide(scene.space()), scene.owed()) == "");
}

}  // namespace

TEST_CASE("What leaves within a callback is in no further pair, what comes is in the next collide",
          "[callbacks]") {
  for (const Configuration& configuration : configurations())
    for (const std::size_t n : {6, 40, 110, 400, 1500}) {
      const int runs = scaled(n > 1000 ? 1 : 3);
      for (int run = 0; run < runs; ++run) {
        const std::uint64_t seed = seedOr(8100, run);
        INFO(configuration.name << ", " << n << " geoms, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        Random random(seed);
        Scene scene(configuration, n, random);
        dParallelSAPSpaceSetNumThreads(scene.space(), random.chance(0.5) ? 1 : 3);
        dParallelSAPSpaceSetEvents(scene.space(), random.chance(0.5));
        dParallelSAPSpaceSetSweptBounds(scene.space(), random.chance(0.3) ? dReal(0.01) : 0);
        for (int i = 0; i < 2 * kWays; ++i) {
          const Way way = static_cast<Way>(random.below(kWays));
          INFO("call " << i << ", way " << way);
          checkCall(scene, way, random);
        }
      }
    }
}

TEST_CASE("Where a callback may not change a space, the message names the function that it called",
          "[callbacks]") {
  for (const std::size_t n : {20, 500}) {
    const Space space;
    for (std::size_t i = 0; i < n; ++i) setNumber(dCreateSphere(space, 1), i);
    const dGeomID loose = dCreateSphere(nullptr, 1);
    struct Call {
      dSpaceID space;
      dGeomID loose;
      std::string said[2];
    } call = {space, loose, {}};
    dParallelSAPSpaceSetNumThreads(space, 1);
    dParallelSAPSpaceCollidePairs(space, &call, dParallelSAPPairsConcurrent,
                                  [](void* data, const dParallelSAPPair* pairs, size_t, size_t) {
                                    Call& self = *static_cast<Call*>(data);
                                    try {
                                      dSpaceAdd(self.space, self.loose);
                                    } catch (const OdeAssertion& assertion) {
                                      self.said[0] = assertion.what();
                                    }
                                    try {
                                      dSpaceRemove(self.space, pairs[0].o1);
                                    } catch (const OdeAssertion& assertion) {
                                      self.said[1] = assertion.what();
                                    }
                                  });
    CHECK(call.said[0] == "Invalid operation for locked space in dSpaceAdd()");
    CHECK(call.said[1] == "Invalid operation for locked space in dSpaceRemove()");
    CHECK(dSpaceGetNumGeoms(space) == static_cast<int>(n));
    dGeomDestroy(loose);
  }
}

TEST_CASE("dHashSpaceSetLevels on this space changes none of its settings, without assertions too",
          "[callbacks]") {
  const Space space;
  const auto settings = [&] {
    return std::vector<int>{dParallelSAPSpaceGetBackend(space), dParallelSAPSpaceGetMethod(space),
                            dParallelSAPSpaceGetNumThreads(space),
                            dParallelSAPSpaceGetNumDevices(space),
                            dParallelSAPSpaceGetCullPlanes(space)};
  };
  const std::vector<int> before = settings();
  int low = 0, high = 0;
  if (odeHasAssertions()) {
    CHECK_THROWS_AS(dHashSpaceSetLevels(space, -10, 7), OdeAssertion);
  } else {
    dHashSpaceGetLevels(space, &low, &high);
    CHECK((low == -3 && high == 10));
    dHashSpaceSetLevels(space, -10, 7);
    dHashSpaceGetLevels(space, &low, &high);
    CHECK((low == -10 && high == 7));
  }
  CHECK(settings() == before);
}
