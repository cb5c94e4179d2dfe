// The tuned constants that several rooms share.
#ifndef ODE_PARALLEL_SAP_TUNING_H
#define ODE_PARALLEL_SAP_TUNING_H

#include <cstddef>

namespace ode_parallel_sap {

// How far ahead of its use something that lies anywhere in memory is asked for.
// Unit: items. From: peers, dense-cube of 1,000,000.
// Doubled: not measured. Halved: not measured.
constexpr std::size_t prefetch_distance = 16;

}  // namespace ode_parallel_sap

#endif
