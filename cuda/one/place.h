// Where boxes begin along the axis on which several devices share a scene. For kernels and host.
#ifndef ODE_PARALLEL_SAP_CUDA_PLACE_H
#define ODE_PARALLEL_SAP_CUDA_PLACE_H

#include <cstdint>

#include "space/data/both_sides.h"
#include "space/data/float_steps.h"

namespace ode_parallel_sap {

// A place along the axis: a bound's order among all floats above, a slot below. Places of boxes are
// those of their lower bounds; as slots differ, so do they, and even boxes in one spot can be cut
// apart.
using Place = std::uint64_t;

ODE_PARALLEL_SAP_BOTH_SIDES inline Place placeOf(float bound, std::uint32_t slot) {
  return Place{unsignedStepNumber(bound)} << 32 | slot;
}

}  // namespace ode_parallel_sap

#endif
