// Where floats are too coarse for boxes, and whether that matters. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/geoms/geom_packer.h"

struct dxGeom;

namespace ode_parallel_sap {

// Boxes that floats make clearly larger overlap others in vain only where they are close together.
// Bodies that have fallen out of a scene, and the small ones of a scene of all sizes, are coarse,
// but lie far apart.
class CoarseBoxes {
 public:
  // Whether more than about `most` pairs of the `coarse` boxes overlap in floats alone, by a sample
  // of them. If so, they count as doing so for some frames. Needs clean geoms.
  bool overlapInVain(dxGeom* const* geoms, const Buffer<SlotState>& states, std::size_t coarse,
                     std::size_t most);
  // Whether there are so many more of them since that the answer may be another.
  bool areManyMore(std::size_t coarse) const { return coarse > 2 * sampled_of_ + most_sampled; }
  std::size_t bytes() const { return bytesOf(sample_); }

 private:
  static constexpr std::size_t most_sampled = 512;
  struct Sampled {
    Box box;
    const dxGeom* geom;
  };
  void take(dxGeom* const* geoms, const Buffer<SlotState>& states, std::size_t coarse);

  std::vector<Sampled> sample_;
  int axis_ = 0;                // by which it is sorted
  std::size_t sampled_of_ = 0;  // coarse boxes
  bool answer_ = false;
  int age_ = 0;  // of the answer, in frames
};

}  // namespace ode_parallel_sap
