// The space of this project: a whole dSpaceCollide, with each method and back end that is to be
// had.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>

#include "../options.h"
#include "ode_geoms.h"

namespace bench {
namespace {

const char* nameOfMethod(int method) {
  switch (method) {
    case dParallelSAPMethodSweep:
      return "sweep";
    case dParallelSAPMethodBruteForce:
      return "brute-force";
    case dParallelSAPMethodAxisLists:
      return "axis-lists";
    default:
      return "auto";
  }
}

// How the pairs are handed over, and whether which of them began and ended is told too.
enum class Report { pairs, blocks, concurrent_blocks, pairs_and_events };

struct Choice {
  const char* name;
  int backend, method;
  Report report = Report::pairs;
};

constexpr Choice choices[] = {
    {"parallel-sap", dParallelSAPBackendCPU, dParallelSAPMethodAuto},
    {"parallel-sap:blocks", dParallelSAPBackendCPU, dParallelSAPMethodAuto, Report::blocks},
    {"parallel-sap:concurrent-blocks", dParallelSAPBackendCPU, dParallelSAPMethodAuto,
     Report::concurrent_blocks},
    {"parallel-sap:events", dParallelSAPBackendCPU, dParallelSAPMethodAuto,
     Report::pairs_and_events},
    {"parallel-sap:auto", dParallelSAPBackendAuto, dParallelSAPMethodAuto},
    {"parallel-sap:sweep", dParallelSAPBackendCPU, dParallelSAPMethodSweep},
    {"parallel-sap:brute-force", dParallelSAPBackendCPU, dParallelSAPMethodBruteForce},
    {"parallel-sap:axis-lists", dParallelSAPBackendCPU, dParallelSAPMethodAxisLists},
    {"parallel-sap:cuda", dParallelSAPBackendCUDA, dParallelSAPMethodAuto},
    {"parallel-sap:cuda-concurrent-blocks", dParallelSAPBackendCUDA, dParallelSAPMethodAuto,
     Report::concurrent_blocks},
    {"parallel-sap:cuda-brute-force", dParallelSAPBackendCUDA, dParallelSAPMethodBruteForce},
    {"parallel-sap:cuda-axis-lists", dParallelSAPBackendCUDA, dParallelSAPMethodAxisLists},
};

// A dParallelSAPPairsCallback; `pairs` points to a std::atomic<std::size_t>.
void countBlock(void* pairs, const dParallelSAPPair*, size_t count, size_t) {
  static_cast<std::atomic<std::size_t>*>(pairs)->fetch_add(count, std::memory_order_relaxed);
}

class ParallelSapPeer : public OdeSpacePeer {
 public:
  ParallelSapPeer(const Choice& choice, int threads) : choice_(choice), threads_(threads) {}

  // 0 where back end or method is not to be had.
  dSpaceID createChosen() const {
    const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
    if (!dParallelSAPSpaceSetBackend(space, choice_.backend) ||
        !dParallelSAPSpaceSetMethod(space, choice_.method)) {
      dSpaceDestroy(space);
      return nullptr;
    }
    dParallelSAPSpaceSetNumThreads(space, threads_);
    dParallelSAPSpaceSetNumDevices(space, options().devices);
    dParallelSAPSpaceSetEvents(space, choice_.report == Report::pairs_and_events);
    return space;
  }

  std::size_t find() override {
    const bool concurrent = choice_.report == Report::concurrent_blocks;
    if (choice_.report != Report::blocks && !concurrent) return OdeSpacePeer::find();
    std::atomic<std::size_t> pairs{0};
    dParallelSAPSpaceCollidePairs(space_, &pairs, concurrent ? dParallelSAPPairsConcurrent : 0,
                                  countBlock);
    return pairs;
  }

  Account account() const override {
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(space_, &stats);
    Account account;
    account.stages = {stats.update_ms, stats.synchronise_ms, stats.extract_ms, stats.filter_ms,
                      stats.report_ms};
    account.own_bytes = static_cast<double>(stats.memory_bytes);
    account.method = nameOfMethod(stats.method);
    account.backend = stats.backend == dParallelSAPBackendCUDA ? "cuda" : "cpu";
    account.threads = stats.threads;
    account.devices = stats.devices;
    return account;
  }

 private:
  dSpaceID createSpace(const Extent&, std::size_t) override { return createChosen(); }

  const Choice choice_;
  const int threads_;
};

// Quadratic in time; the lists of one axis are quadratic in memory.
std::size_t mostBoxes(int method) {
  if (method == dParallelSAPMethodBruteForce) return 200000;
  if (method == dParallelSAPMethodAxisLists) return 50000;
  return std::numeric_limits<std::size_t>::max();
}

}  // namespace

void addParallelSapPeers(std::vector<PeerKind>& kinds) {
  for (const Choice& choice : choices) {
    PeerKind kind;
    kind.name = choice.name;
    kind.library = std::string("ode-parallel-sap " BENCH_PROJECT_VERSION " on ") + odeVersion();
    kind.takes_threads = true;
    kind.most = mostBoxes(choice.method);
    kind.create = [choice](int threads) -> std::unique_ptr<Peer> {
      auto peer = std::make_unique<ParallelSapPeer>(choice, threads);
      const dSpaceID probe = peer->createChosen();
      if (!probe) return nullptr;
      dSpaceDestroy(probe);
      return peer;
    };
    kinds.push_back(kind);
  }
}

}  // namespace bench
