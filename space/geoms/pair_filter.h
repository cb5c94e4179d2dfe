// The filter stage: what boxes could not decide is decided on the geoms.
#pragma once

#include "space/base/pair_list.h"
#include "space/geoms/geom_update.h"

namespace ode_parallel_sap {

class PairFilter {
 public:
  // Drops the pairs that ODE's exact formula excludes, AABBTest apart, and those that the rules
  // leave out and boxes could not, and with `planes` those that are clear of one; the
  // others stay in order, borderline_bit cleared. The geoms behind all slots in `pairs` are clean,
  // and packed by `update`.
  void dropExcluded(dxGeom* const* geoms, const GeomUpdate& update, const PackRules& rules,
                    bool planes, int threads, PairList& pairs);
  // Puts into `verified` those of the pairs that their geoms do not rule out in this frame.
  // `user_classes`: AABBTest functions may.
  static void verify(dxGeom* const* geoms, const PackRules& rules, bool user_classes, int threads,
                     const PairList& pairs, PairList& verified);
  std::size_t bytes() const { return bytesOf(closed_); }

 private:
  void closeGaps(int threads, PairList& pairs);

  PairList closed_;
};

}  // namespace ode_parallel_sap
