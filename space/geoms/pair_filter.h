// What boxes could not decide is decided on the geoms.
#pragma once

#include "space/base/pair_list.h"
#include "space/geoms/geom_update.h"

namespace ode_parallel_sap {

// Keeps the pairs of ODE's exact formula, AABBTest apart, that the rules do not leave out. Finders
// use it for the pairs that they write.
class PairFilter final : public PairTest {
 public:
  // The geoms behind all slots are clean, and packed by `update`, up to its last use.
  PairFilter(dxGeom* const* geoms, const GeomUpdate& update, const PairRules& rules);
  Pair* keep(Pair* begin, Pair* end) const override;

 private:
  bool drops(Pair pair) const;

  dxGeom* const* const geoms_;
  const GeomUpdate& update_;
  const PairRules& rules_;
};

// Puts into `verified` those of the pairs that their geoms do not rule out in this frame.
// `user_classes`: AABBTest functions may.
void verifyPairs(dxGeom* const* geoms, const PairRules& rules, bool user_classes, int threads,
                 const PairList& pairs, PairList& verified);

}  // namespace ode_parallel_sap
