// The space of this project: a whole dSpaceCollide, with each method and back end that is to be
// had.
#include <ode_parallel_sap/parallel_sap_space.h>

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

struct Choice {
  const char* name;
  int backend, method;
};

constexpr Choice choices[] = {
    {"parallel-sap", dParallelSAPBackendCPU, dParallelSAPMethodAuto},
    {"parallel-sap:auto", dParallelSAPBackendAuto, dParallelSAPMethodAuto},
    {"parallel-sap:sweep", dParallelSAPBackendCPU, dParallelSAPMethodSweep},
    {"parallel-sap:brute-force", dParallelSAPBackendCPU, dParallelSAPMethodBruteForce},
    {"parallel-sap:axis-lists", dParallelSAPBackendCPU, dParallelSAPMethodAxisLists},
    {"parallel-sap:cuda", dParallelSAPBackendCUDA, dParallelSAPMethodAuto},
    {"parallel-sap:cuda-brute-force", dParallelSAPBackendCUDA, dParallelSAPMethodBruteForce},
    {"parallel-sap:cuda-axis-lists", dParallelSAPBackendCUDA, dParallelSAPMethodAxisLists},
};

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
    return space;
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
