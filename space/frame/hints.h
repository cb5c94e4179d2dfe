// What would have made frames quicker, from what they were seen to do.
#pragma once

#include <string>

#include "space/frame/frame_sums.h"
#include "space/frame/sampled_pairs.h"

namespace ode_parallel_sap {

// One line, without its end, that names what would have saved how much of the time of frames; empty
// where nothing would have saved a hundredth, or too little was seen to tell.
std::string hintsOf(const FrameSums::Sums& frames, const SampledPairs& seen);

}  // namespace ode_parallel_sap
