// The space of this project: a whole dSpaceCollide, with each method and back end that is to be
// had.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>

#include "known_pairs.h"
#include "ode_geoms.h"

namespace bench {
namespace {

// How the pairs are handed over. `events` is for a program that keeps what it wants of each pair:
// those that began and ended are all it gets.
enum class Report { pairs, blocks, concurrent_blocks, events, contacts };

struct Choice {
  const char* name;
  int backend, method;
  Report report = Report::pairs;
  bool sleeps = false;    // what does not move is asleep, and pairs of sleepers are left out
  bool notified = false;  // the program tells what it changes besides places and sizes
};

constexpr Choice choices[] = {
    {"parallel-sap", dParallelSAPBackendCPU, dParallelSAPMethodAuto},
    {"parallel-sap:blocks", dParallelSAPBackendCPU, dParallelSAPMethodAuto, Report::blocks},
    {"parallel-sap:concurrent-blocks", dParallelSAPBackendCPU, dParallelSAPMethodAuto,
     Report::concurrent_blocks},
    {"parallel-sap:contacts", dParallelSAPBackendCPU, dParallelSAPMethodAuto, Report::contacts},
    {"parallel-sap:begun-ended", dParallelSAPBackendCPU, dParallelSAPMethodAuto, Report::events},
    {"parallel-sap:skip-asleep", dParallelSAPBackendCPU, dParallelSAPMethodAuto, Report::pairs,
     true},
    {"parallel-sap:skip-asleep-begun-ended", dParallelSAPBackendCPU, dParallelSAPMethodAuto,
     Report::events, true},
    {"parallel-sap:notified-begun-ended", dParallelSAPBackendCPU, dParallelSAPMethodAuto,
     Report::events, false, true},
    {"parallel-sap:notified-skip-asleep-begun-ended", dParallelSAPBackendCPU,
     dParallelSAPMethodAuto, Report::events, true, true},
    {"parallel-sap:brute-force", dParallelSAPBackendCPU, dParallelSAPMethodBruteForce},
    {"parallel-sap:axis-lists", dParallelSAPBackendCPU, dParallelSAPMethodAxisLists},
    {"parallel-sap:cuda", dParallelSAPBackendCUDA, dParallelSAPMethodAuto},
    {"parallel-sap:cuda-concurrent-blocks", dParallelSAPBackendCUDA, dParallelSAPMethodAuto,
     Report::concurrent_blocks},
    {"parallel-sap:cuda-axis-lists", dParallelSAPBackendCUDA, dParallelSAPMethodAxisLists},
};

std::size_t numberOf(dGeomID geom) {
  return reinterpret_cast<std::size_t>(dGeomGetData(geom));
}

// A dParallelSAPPairsCallback; `pairs` points to a std::atomic<std::size_t>.
void countBlock(void* pairs, const dParallelSAPPair*, size_t count, size_t) {
  static_cast<std::atomic<std::size_t>*>(pairs)->fetch_add(count, std::memory_order_relaxed);
}

// A dParallelSAPContactCallback that needs none.
void leaveContacts(void*, dGeomID, dGeomID, const dContactGeom*, int) {}

class ParallelSapPeer : public OdeSpacePeer {
 public:
  ParallelSapPeer(const Choice& choice, int threads)
      : OdeSpacePeer(choice.sleeps), choice_(choice), threads_(threads) {}

  // 0 where back end or method is not to be had.
  dSpaceID createChosen() const {
    const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
    if (!dParallelSAPSpaceSetBackend(space, choice_.backend) ||
        !dParallelSAPSpaceSetMethod(space, choice_.method)) {
      dSpaceDestroy(space);
      return nullptr;
    }
    dParallelSAPSpaceSetNumThreads(space, threads_);
    dParallelSAPSpaceSetEvents(space, choice_.report == Report::events);
    dParallelSAPSpaceSetSkipAsleep(space, choice_.sleeps);
    dParallelSAPSpaceSetNotified(space, choice_.notified);
    return space;
  }

  void move(const Boxes& boxes) override {
    settle();
    OdeSpacePeer::move(boxes);
  }

  std::size_t find() override {
    if (choice_.report == Report::events) return findEvents();
    if (choice_.report == Report::contacts) return findContacts();
    const bool concurrent = choice_.report == Report::concurrent_blocks;
    if (choice_.report != Report::blocks && !concurrent) return OdeSpacePeer::find();
    std::atomic<std::size_t> pairs{0};
    dParallelSAPSpaceCollidePairs(space_, &pairs, concurrent ? dParallelSAPPairsConcurrent : 0,
                                  countBlock);
    return pairs;
  }

  void visit(const PairVisitor& visitor) override {
    if (choice_.report != Report::events) return OdeSpacePeer::visit(visitor);
    find();
    settle();
    known_.tellAll(visitor);
  }

  Account account() const override {
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(space_, &stats);
    Account account;
    account.stages = {stats.update_ms, stats.extract_ms, stats.filter_ms, stats.report_ms};
    account.own_bytes = static_cast<double>(stats.memory_bytes);
    account.threads = stats.threads;
    account.devices = stats.devices;
    return account;
  }

 private:
  dSpaceID createSpace(const Extent&, std::size_t) override { return createChosen(); }
  void woke(dGeomID geom) override {
    if (space_) dParallelSAPSpaceNotify(space_, geom);
  }

  // Up to four of each pair, as for joints.
  std::size_t findContacts() {
    const dParallelSAPContactCallbacks callbacks = dParallelSAPContactCallbacksOf(leaveContacts);
    dParallelSAPSpaceCollideContacts(space_, nullptr, 4, &callbacks);
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(space_, &stats);
    return static_cast<std::size_t>(stats.pairs);
  }

  std::size_t findEvents() {
    settle();
    dParallelSAPSpaceCollidePairs(space_, nullptr, 0, nullptr);
    begun_count_ = dParallelSAPSpaceGetBegunPairs(space_, &begun_);
    ended_count_ = dParallelSAPSpaceGetEndedPairs(space_, &ended_);
    return pairs_ += begun_count_ - ended_count_;
  }

  // What is done with the last find's events when no clock runs.
  void settle() {
    if (known_.isKept()) {
      for (std::size_t i = 0; i < ended_count_; ++i)
        known_.end(numberOf(ended_[i].o1), numberOf(ended_[i].o2));
      for (std::size_t i = 0; i < begun_count_; ++i)
        known_.begin(numberOf(begun_[i].o1), numberOf(begun_[i].o2));
    }
    begun_count_ = ended_count_ = 0;
  }

  const Choice choice_;
  const int threads_;
  const dParallelSAPPairEvent *begun_ = nullptr, *ended_ = nullptr;
  std::size_t begun_count_ = 0, ended_count_ = 0, pairs_ = 0;
  KnownPairs known_;
};

const AddPeers added([](std::vector<PeerKind>& kinds) {
  for (const Choice& choice : choices) {
    PeerKind kind;
    kind.name = choice.name;
    kind.library = std::string("ode-parallel-sap " BENCH_PROJECT_VERSION " on ") + odeVersion();
    kind.takes_threads = kind.chooses_threads = true;
    kind.leaves_out_rest = choice.sleeps;
    kind.create = [choice](int threads) -> std::unique_ptr<Peer> {
      auto peer = std::make_unique<ParallelSapPeer>(choice, threads);
      const dSpaceID probe = peer->createChosen();
      if (!probe) return nullptr;
      dSpaceDestroy(probe);
      return peer;
    };
    kinds.push_back(kind);
  }
});

}  // namespace
}  // namespace bench
