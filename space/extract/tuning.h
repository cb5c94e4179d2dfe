// The tuned constants of the sweep.
#ifndef ODE_PARALLEL_SAP_EXTRACT_TUNING_H
#define ODE_PARALLEL_SAP_EXTRACT_TUNING_H

#include <cstddef>

namespace ode_parallel_sap {

// Up to this number of cells of unbounded boxes every one of these meets all others. A row of
// sixteen is then all of one plane's pairs with sixteen boxes; many are better found by a tree.
// Unit: cells. From: planes.
// Doubled: not measured. Halved: not measured.
constexpr std::size_t most_reaching_cells = 16;

}  // namespace ode_parallel_sap

#endif
