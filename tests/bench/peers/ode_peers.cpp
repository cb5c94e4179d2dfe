// ODE's own four spaces, and that of this project with each method and back end that is to be had:
// boxes as geoms, a whole dSpaceCollide.
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

#include "../program.h"
#include "known_pairs.h"

namespace bench {
namespace {

std::size_t numberOf(dGeomID geom) {
  return reinterpret_cast<std::size_t>(dGeomGetData(geom));
}

void tell(void* data, dGeomID first, dGeomID second) {
  (*static_cast<const PairVisitor*>(data))(numberOf(first), numberOf(second));
}

class OdeSpacePeer : public Peer {
 public:
  // Once the geoms exist. The space neither owns nor destroys them.
  using Create = dSpaceID (*)(const Extent& extent, std::size_t count);
  explicit OdeSpacePeer(Create create = nullptr) : create_(create) {}

  ~OdeSpacePeer() override {
    // Out of the space from the last to the first: the order that every space is quick at.
    if (space_) {
      dSpaceSetCleanup(space_, 0);
      dSpaceDestroy(space_);
    }
    for (dGeomID geom : geoms_) dGeomDestroy(geom);
    dWorldDestroy(world_);
  }

  void create(const Boxes& boxes) override {
    geoms_.reserve(boxes.size());
    for (const CentredBox& box : boxes) {
      const dGeomID geom = dCreateBox(nullptr, 2 * box.half[0], 2 * box.half[1], 2 * box.half[2]);
      dGeomSetData(geom, reinterpret_cast<void*>(geoms_.size()));
      dGeomSetPosition(geom, box.centre[0], box.centre[1], box.centre[2]);
      geoms_.push_back(geom);
    }
    shown_ = boxes;
  }

  void enter() override {
    space_ = createSpace();
    for (dGeomID geom : geoms_) dSpaceAdd(space_, geom);
  }

  void move(const Boxes& boxes) override {
    for (std::size_t i = 0; i < geoms_.size(); ++i) {
      const CentredBox& box = boxes[i];
      const bool moves = !(box == shown_[i]);
      rests(geoms_[i], !moves);
      if (!moves) continue;
      if (!box.sameSizeAs(shown_[i]))
        dGeomBoxSetLengths(geoms_[i], 2 * box.half[0], 2 * box.half[1], 2 * box.half[2]);
      shown_[i] = box;
      dGeomSetPosition(geoms_[i], box.centre[0], box.centre[1], box.centre[2]);
    }
  }

  std::size_t find(const PairVisitor* visitor) override {
    std::size_t pairs = 0;
    if (visitor)
      dSpaceCollide(space_, const_cast<PairVisitor*>(visitor), tell);
    else
      dSpaceCollide(space_, &pairs, countPair);
    return pairs;
  }

 protected:
  virtual dSpaceID createSpace() { return create_(extentOf(shown_), geoms_.size()); }
  // What becomes of a geom's body with each move.
  virtual void rests(dGeomID, bool) {}

  dSpaceID space_ = nullptr;
  const dWorldID world_ = dWorldCreate();

 private:
  const Create create_;
  std::vector<dGeomID> geoms_;
  Boxes shown_;
};

// With its default levels, as programs use it.
dSpaceID createHashSpace(const Extent& extent, std::size_t) {
  for (int axis = 0; axis < 3; ++axis)
    if (std::max(-extent.low[axis], extent.high[axis]) > 1e8)
      throw std::runtime_error("its cells' numbers overflow, which ends the program");
  return dHashSpaceCreate(nullptr);
}

// About four geoms in a leaf: a little deeper or shallower is slower.
dSpaceID createQuadTree(const Extent& extent, std::size_t count) {
  dVector3 centre, half;
  for (int axis = 0; axis < 3; ++axis) {
    centre[axis] = static_cast<dReal>((extent.low[axis] + extent.high[axis]) / 2);
    half[axis] = static_cast<dReal>((extent.high[axis] - extent.low[axis]) / 2 * 1.1);
  }
  const double leaves = std::max(static_cast<double>(count) / 4, 1.0);
  const int depth = static_cast<int>(std::lround(std::log(leaves) / std::log(4.0)));
  return dQuadTreeSpaceCreate(nullptr, centre, half, std::clamp(depth, 1, 8));
}

PeerKind odeKind(const char* name, std::size_t most, OdeSpacePeer::Create create,
                 const char* superset = "") {
  const char* const precision = sizeof(dReal) == sizeof(double) ? "double" : "single";
  return {name,
          std::string("ODE " BENCH_ODE_VERSION ", ") + precision + " precision",
          [create](int) { return std::make_unique<OdeSpacePeer>(create); },
          superset,
          false,
          most};
}

// What a variant does is in its name. `begun-ended` is for a program that keeps what it wants of
// each pair: those that began and ended are all it gets. With `notified` it tells what it changes
// besides places and sizes.
constexpr const char* variants[] = {"",
                                    ":concurrent-blocks",
                                    ":contacts",
                                    ":begun-ended",
                                    ":skip-asleep",
                                    ":skip-asleep-begun-ended",
                                    ":skip-static",
                                    ":notified",
                                    ":notified-begun-ended",
                                    ":notified-skip-asleep",
                                    ":notified-skip-asleep-begun-ended",
                                    ":tolerance-0.2",
                                    ":tolerance-0.002",
                                    ":brute-force",
                                    ":axis-lists",
                                    ":cuda",
                                    ":cuda-concurrent-blocks",
                                    ":cuda-axis-lists"};

class ParallelSapPeer : public OdeSpacePeer {
 public:
  ParallelSapPeer(const std::string& variant, int threads) : variant_(variant), threads_(threads) {}

  // 0 where back end or method is not to be had.
  dSpaceID createSpace() override {
    const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
    if (!dParallelSAPSpaceSetBackend(
            space, has("cuda") ? dParallelSAPBackendCUDA : dParallelSAPBackendCPU) ||
        !dParallelSAPSpaceSetMethod(space, has("brute-force")  ? dParallelSAPMethodBruteForce
                                           : has("axis-lists") ? dParallelSAPMethodAxisLists
                                                               : dParallelSAPMethodAuto)) {
      dSpaceDestroy(space);
      return nullptr;
    }
    dParallelSAPSpaceSetNumThreads(space, threads_);
    dParallelSAPSpaceSetEvents(space, tells_events_);
    dParallelSAPSpaceSetSkipAsleep(space, skips_asleep_);
    dParallelSAPSpaceSetSkipStatic(space, skips_static_);
    dParallelSAPSpaceSetNotified(space, has("notified"));
    if (const std::size_t at = variant_.find("tolerance-"); at != std::string::npos)
      dParallelSAPSpaceSetTolerance(space, static_cast<dReal>(std::stod(variant_.substr(at + 10))));
    return space;
  }

  std::size_t find(const PairVisitor* visitor) override {
    if (tells_events_) return findEvents(visitor);
    if (visitor || !(finds_contacts_ || takes_blocks_)) return OdeSpacePeer::find(visitor);
    if (finds_contacts_) {  // up to four of each pair, as for joints
      const dParallelSAPContactCallbacks callbacks =
          dParallelSAPContactCallbacksOf([](void*, dGeomID, dGeomID, const dContactGeom*, int) {});
      dParallelSAPSpaceCollideContacts(space_, nullptr, 4, &callbacks);
      return static_cast<std::size_t>(stats().pairs);
    }
    std::atomic<std::size_t> pairs{0};
    dParallelSAPSpaceCollidePairs(space_, &pairs, concurrent_ ? dParallelSAPPairsConcurrent : 0,
                                  [](void* sum, const dParallelSAPPair*, size_t count, size_t) {
                                    static_cast<std::atomic<std::size_t>*>(sum)->fetch_add(
                                        count, std::memory_order_relaxed);
                                  });
    return pairs;
  }

  Account account() const override {
    const dParallelSAPStats s = stats();
    return {s.update_ms, s.extract_ms, s.filter_ms, s.report_ms, double(s.memory_bytes),
            s.threads,   s.devices};
  }

 private:
  bool has(const char* word) const { return variant_.find(word) != std::string::npos; }

  dParallelSAPStats stats() const {
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(space_, &stats);
    return stats;
  }

  // Where pairs at rest are left out, what moves has a body, and so has what is asleep.
  void rests(dGeomID geom, bool rests) override {
    dBodyID body = dGeomGetBody(geom);
    if (!body && (skips_asleep_ || (skips_static_ && !rests))) {
      body = dBodyCreate(world_);
      const dReal* const at = dGeomGetPosition(geom);
      dBodySetPosition(body, at[0], at[1], at[2]);
      dGeomSetBody(geom, body);
    }
    if (!body || rests == !dBodyIsEnabled(body)) return;
    (rests ? dBodyDisable : dBodyEnable)(body);
    if (space_ && !rests) dParallelSAPSpaceNotify(space_, geom);
  }

  std::size_t findEvents(const PairVisitor* visitor) {
    dParallelSAPSpaceCollidePairs(space_, nullptr, 0, nullptr);
    const dParallelSAPPairEvent *begun = nullptr, *ended = nullptr;
    const std::size_t begun_count = dParallelSAPSpaceGetBegunPairs(space_, &begun);
    const std::size_t ended_count = dParallelSAPSpaceGetEndedPairs(space_, &ended);
    known_.follow(begun, begun_count, ended, ended_count, [](const dParallelSAPPairEvent& event) {
      return std::make_pair(numberOf(event.o1), numberOf(event.o2));
    });
    if (visitor) known_.tellAll(*visitor);
    return known_.count();
  }

  const std::string variant_;
  const int threads_;
  const bool tells_events_ = has("begun-ended"), finds_contacts_ = has("contacts"),
             takes_blocks_ = has("blocks"), concurrent_ = has("concurrent"),
             skips_asleep_ = has("skip-asleep"), skips_static_ = has("skip-static");
  KnownPairs known_;
};

const struct AddAll {
  AddAll() {
    // The hash space keeps a table of n * n bits, whose size overflows an int at 131,072 geoms.
    const AddPeer hash(odeKind("dHashSpace", 120000, createHashSpace));
    const AddPeer sap(odeKind(
        "dSweepAndPruneSpace", 1000000,
        [](const Extent&, std::size_t) {
          return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
        },
        "float bounds on one axis"));
    const AddPeer quadtree(odeKind("dQuadTreeSpace", 300000, createQuadTree));
    const AddPeer simple(odeKind("dSimpleSpace", 10000, [](const Extent&, std::size_t) {
      return dSimpleSpaceCreate(nullptr);
    }));
    const std::string on = odeKind("", 0, nullptr).library;
    for (const std::string variant : variants) {
      PeerKind kind = {"parallel-sap" + variant,
                       "ode-parallel-sap " BENCH_PROJECT_VERSION " on " + on,
                       [variant](int threads) -> std::unique_ptr<Peer> {
                         auto peer = std::make_unique<ParallelSapPeer>(variant, threads);
                         const dSpaceID probe = peer->createSpace();
                         if (!probe) return nullptr;
                         dSpaceDestroy(probe);
                         return peer;
                       },
                       variant.find("tolerance") == std::string::npos ? "" : "a tolerance", true};
      kind.chooses_threads = true;
      kind.leaves_out_rest = variant.find("skip") != std::string::npos;
      peerKinds().push_back(kind);
    }
  }
} all;

}  // namespace
}  // namespace bench
