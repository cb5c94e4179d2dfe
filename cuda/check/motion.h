// Boxes that move from frame to frame, where they lie, as those of a space do.
#pragma once

#include <cstddef>
#include <vector>

#include "space/base/box_set.h"

namespace cuda_check {

// Every box goes back and forth around its place, in each frame by up to a tenth of its width along
// each axis, so that the distribution stays what it is. Bounds that are not finite stay.
class Motion {
 public:
  explicit Motion(ode_parallel_sap::BoxSet& boxes);
  // The next frame's boxes.
  void advance();

 private:
  ode_parallel_sap::BoxSet& boxes_;
  std::vector<ode_parallel_sap::Box> places_;
  int frame_ = 0;
};

}  // namespace cuda_check
