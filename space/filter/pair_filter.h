// The filter stage: what boxes could not decide is decided on the geoms.
#ifndef ODE_PARALLEL_SAP_PAIR_FILTER_H
#define ODE_PARALLEL_SAP_PAIR_FILTER_H

#include <vector>

#include "space/data/pair_list.h"
#include "space/update/geom_update.h"

namespace ode_parallel_sap {

class PairFilter {
 public:
  // Drops the pairs that ODE's exact formula excludes, AABBTest apart, and those that the rules
  // leave out and `boxes` could not; the others stay in order, unsure_bit cleared. The geoms
  // behind all slots in `pairs` are clean and without NaN. Uses up to `threads` threads.
  void run(dxGeom* const* geoms, const UpdateFacts& facts, const PackRules& rules,
           const BoxSet& boxes, int threads, PairList& pairs);

  // Whether pairs that passed have to pass verify() as well, in every frame anew.
  static bool needsVerifying(const UpdateFacts& facts, const PackRules& rules) {
    return facts.user_classes || rules.skip_static || rules.skip_asleep;
  }
  // Leaves the pairs to be reported: those whose geoms are enabled and have the bits for it, which
  // was not looked at for geoms at rest, and which pass the AABBTest functions, called on the
  // calling thread.
  static void verify(dxGeom* const* geoms, const UpdateFacts& facts, int threads, PairList& pairs);

 private:
  struct ExactTest;
  static void verifyChunk(dxGeom* const* geoms, bool user_classes, Pair* begin, Pair* end);
  std::size_t testStretches(const ExactTest& test, int threads, PairList& pairs);

  std::vector<PairList::Stretch> chunks_;
};

}  // namespace ode_parallel_sap

#endif
