#include "space/frame/statistics.h"

#include <algorithm>

namespace ode_parallel_sap {

// Of the last frame nothing is left but its number.
void Statistics::clear() {
  const unsigned long long frames = last_.frames;
  last_ = {};
  last_.frames = frames;
}

void Statistics::note(const FrameResult& result) {
  clear();
  last_was_small_ = false;
  noteCounts(result);
  last_.contacts = result.contacts;
  last_.apart = result.apart;
  last_.kept = result.kept;
  last_.candidates_kept = result.fat_candidates;
  last_.backend = result.found.devices > 0 ? dParallelSAPBackendCUDA : dParallelSAPBackendCPU;
  last_.method = result.found.method;
  last_.threads = std::max({result.threads, result.narrow_threads, result.block_threads});
  last_.find_threads = result.threads;
  last_.narrow_threads = result.narrow_threads;
  last_.devices = result.found.devices;
  last_.update_ms = result.update_ms;
  last_.synchronise_ms = result.synchronise_ms;
  last_.extract_ms = result.extract_ms;
  last_.filter_ms = result.filter_ms;
  last_.narrow_ms = result.narrow_ms;
  last_.events_ms = result.events_ms;
  last_.report_ms = result.report_ms;
  last_.total_ms = result.total_ms;
}

// The first small frame after another: what is the same of all.
void Statistics::beginSmall() {
  clear();
  last_.backend = dParallelSAPBackendCPU;
  last_.method = dParallelSAPMethodBruteForce;
  last_.threads = 1;
  last_.find_threads = 1;
  last_was_small_ = true;
}

void Statistics::noteTimes(double found_ms, double report_ms) {
  last_.extract_ms = found_ms;
  last_.report_ms = report_ms;
  last_.total_ms = found_ms + report_ms;
}

}  // namespace ode_parallel_sap
