// Stands between a frame and the program's callback, and sums up the pairs for a trace. Sees ODE's
// private headers.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>
#include <cstdint>

#include "space/trace/trace.h"
#include "space/trace/trace_format.h"

namespace ode_parallel_sap {

class PairTally {
 public:
  PairTally(const Trace& trace, void* data, dNearCallback* near_callback)
      : trace_(trace), data_(data), near_callback_(near_callback) {}
  PairTally(const Trace& trace, void* data, dParallelSAPPairsCallback* pairs_callback)
      : trace_(trace), data_(data), pairs_callback_(pairs_callback) {}

  // Callbacks whose data are the tally.
  static void passPair(void* tally, dGeomID o1, dGeomID o2) {
    PairTally& own = *static_cast<PairTally*>(tally);
    own.add(1, own.sumOf(o1, o2));
    own.near_callback_(own.data_, o1, o2);
  }
  static void passBlock(void* tally, const dParallelSAPPair* pairs, size_t count, size_t first) {
    PairTally& own = *static_cast<PairTally*>(tally);
    std::uint64_t sum = 0;
    for (size_t i = 0; i < count; ++i) sum += own.sumOf(pairs[i].o1, pairs[i].o2);
    own.add(count, sum);
    if (own.pairs_callback_) own.pairs_callback_(own.data_, pairs, count, first);
  }

  void writeTo(Trace& trace) const { trace.writePairs(pairs_, sum_); }

 private:
  std::uint64_t sumOf(dGeomID o1, dGeomID o2) const {
    return trace_format::pairSum(trace_.numberOf(o1), trace_.numberOf(o2));
  }
  void add(std::uint64_t pairs, std::uint64_t sum) {
    pairs_.fetch_add(pairs, std::memory_order_relaxed);
    sum_.fetch_add(sum, std::memory_order_relaxed);
  }

  const Trace& trace_;
  void* const data_;
  dNearCallback* const near_callback_ = nullptr;
  dParallelSAPPairsCallback* const pairs_callback_ = nullptr;
  std::atomic<std::uint64_t> pairs_{0}, sum_{0};
};

}  // namespace ode_parallel_sap
