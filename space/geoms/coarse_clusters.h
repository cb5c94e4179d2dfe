// Where floats are too coarse for boxes, and whether that matters.
#pragma once

#include <cstddef>
#include <cstdint>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/geoms/tuning.h"

namespace ode_parallel_sap {

// Boxes that floats make clearly larger overlap others in vain only where they are close together:
// in scenes of all sizes the small ones are coarse, but lie far apart. Boxes of like size are
// counted by the cells, of about their size, that they lie in.
class CoarseClusters {
 public:
  // The pairs of those of `coarse` that share a cell: about as many as floats might let through in
  // vain. Stops counting beyond `most`, which is below 2^31. Uses up to `threads` threads; whether
  // there are more than `most` does not depend on them. Needs exactMode().
  std::size_t count(const BoxSet& boxes, const Buffer<Slot>& coarse, std::size_t most, int threads);
  std::size_t bytes() const { return counts_.bytes(); }

 private:
  Buffer<std::uint16_t> counts_;  // by hash: cells that share one only seem fuller
};

}  // namespace ode_parallel_sap
