// The filter stage: what boxes could not decide is decided on the geoms.
#ifndef ODE_PARALLEL_SAP_PAIR_FILTER_H
#define ODE_PARALLEL_SAP_PAIR_FILTER_H

#include <vector>

#include "geom_update.h"
#include "pair_list.h"

namespace ode_parallel_sap {

class PairFilter {
 public:
  // Drops the pairs that ODE's exact formula excludes; the others stay in order, unsure_bit
  // cleared. Pairs are tested by up to `threads` threads, AABBTest functions are called on the
  // calling thread. The geoms behind all slots in `pairs` are clean and without NaN.
  void run(dxGeom* const* geoms, const UpdateFacts& facts, int threads, PairList& pairs);

 private:
  struct ExactTest;
  std::size_t testStretches(const ExactTest& test, int threads, PairList& pairs);

  std::vector<PairList::Stretch> chunks_;
};

}  // namespace ode_parallel_sap

#endif
