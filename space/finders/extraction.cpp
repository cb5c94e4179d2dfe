#include "space/finders/extraction.h"

#include <algorithm>

namespace ode_parallel_sap {

Found Extraction::find(const BoxSet& boxes, const ExtractionPlan& plan, PairList& pairs) {
  try {
    return findBy(plan.method, boxes, plan, pairs);
  } catch (const ListsTooLong& lists) {
    Found found = findBy(dParallelSAPMethodSweep, boxes, plan, pairs);
    found.too_long = lists;
    return found;
  }
}

Found Extraction::findBy(int method, const BoxSet& boxes, const ExtractionPlan& plan,
                         PairList& pairs) {
  Found found;
  found.method = method;
  if (plan.devices > 0) found.devices = devices_.find(method, boxes, plan, pairs);
  if (found.devices > 0) return found;
  const auto findOnCPU = [&](auto& by) {
    by.axis_lists.limit(plan.axis_lists_bytes);
    found.threads = by.of(method).find(boxes, plan.threads, pairs);
  };
  boxes.wide ? findOnCPU(doubles_) : findOnCPU(floats_);
  return found;
}

}  // namespace ode_parallel_sap
