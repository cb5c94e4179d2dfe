// Brute force: every pair of boxes is tested.
#ifndef ODE_PARALLEL_SAP_BRUTE_FORCE_H
#define ODE_PARALLEL_SAP_BRUTE_FORCE_H

#include "buffer.h"
#include "cell_tree.h"
#include "pair_finder.h"

namespace ode_parallel_sap {

// The multi-core algorithm of Avril, Gouranton and Arnaldi ("Collision Detection: Broad Phase
// Adaptation from Multi-Core to Multi-GPU Architecture", section 4.1): each of c threads tests
// ((n^2-n)/2)/c pairs and writes those that overlap to storage of its own, without critical
// section; in the end the parts are joined by pointer. The pairs are numbered row by row, so that
// the parts, read one after the other, are in the order of the report already.
template <class Real>
class BruteForce : public PairFinder {
 public:
  int find(const BoxSet& boxes, int threads, PairList& pairs) override;
  std::size_t bytes() const override { return cells_.bytes() + starts_.bytes(); }

 private:
  Buffer<std::uint32_t> starts_;  // of the cells: 0, 16, 32, ...
  CellTree<Real> cells_;          // in slot order; only its cells are used
};

}  // namespace ode_parallel_sap

#endif
