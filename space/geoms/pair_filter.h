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
  PairFilter(dxGeom* const* geoms, const GeomUpdate& update, const PackRules& rules);
  Pair* keep(Pair* begin, Pair* end) const override;

 private:
  bool drops(Pair pair) const;
  bool atRest(Slot slot) const { return bodies_[slot] == resting_body; }
  bool isStatic(Slot slot) const { return bodies_[slot] == 0 && !IS_SPACE(geoms_[slot]); }

  dxGeom* const* const geoms_;
  const BodyKey* const bodies_;       // by slot
  const bool every_filter_;           // the bits beside the boxes do not decide
  const bool asleep_on_static_;       // pairs of a geom asleep and a static one are not wanted
  const bool packed_bits_at_rest_;    // geoms at rest have their own bits
  const SlotState* const of_planes_;  // by slot, unbounded_state where planes are; null: not culled
};

// Puts into `verified` those of the pairs that their geoms do not rule out in this frame.
// `user_classes`: AABBTest functions may.
void verifyPairs(dxGeom* const* geoms, const PackRules& rules, bool user_classes, int threads,
                 const PairList& pairs, PairList& verified);

}  // namespace ode_parallel_sap
