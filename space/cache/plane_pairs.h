// The pairs of planes with all other geoms, less those that are clear of them. Sees ODE's private
// headers.
#pragma once

#include "space/base/pair_list.h"
#include "space/base/slot_set.h"
#include "space/cache/changed_pairs.h"
#include "space/geoms/geom_update.h"

namespace ode_parallel_sap {

// The bounding boxes of oblique planes overlap all others. So finders do without culled planes,
// which are tested geom by geom. Their pairs are kept like any other.
class PlanePairs {
 public:
  // Finds the pairs of planes that are packed, and makes the boxes of these planes inactive.
  void take(dxGeom* const* geoms, GeomUpdate& update, int threads);
  bool any() const { return set_.count() != 0; }
  // These pairs, ascending.
  PairList& found() { return pairs_.found(); }
  // Puts them into `pairs`, which are ascending, and the boxes back.
  void putBack(dxGeom* const* geoms, BoxSet& boxes, int threads, PairList& pairs);
  std::size_t bytes() const { return bytesOf(set_, pairs_); }

 private:
  SlotSet set_;
  ChangedPairs pairs_;
};

}  // namespace ode_parallel_sap
