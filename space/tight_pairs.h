// The pairs of loose boxes, told apart by where the geoms are. Sees ODE's private headers.
#ifndef ODE_PARALLEL_SAP_TIGHT_PAIRS_H
#define ODE_PARALLEL_SAP_TIGHT_PAIRS_H

#include <cstddef>
#include <vector>

#include "box_set.h"
#include "pair_list.h"

struct dxGeom;

namespace ode_parallel_sap {

class TightPairs {
 public:
  // Makes `tight` those of the pairs `loose` whose geoms' own bounds overlap, in their order.
  // `exact`: boxes.tight are these bounds. Uses up to `threads` threads; returns the number used.
  int select(dxGeom* const* geoms, const BoxSet& boxes, bool exact, const PairList& loose,
             int threads, PairList& tight);

 private:
  std::vector<PairList::Stretch> chunks_;
};

}  // namespace ode_parallel_sap

#endif
