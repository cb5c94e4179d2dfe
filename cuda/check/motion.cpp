#include "cuda/check/motion.h"

#include <cmath>
#include <cstdint>

#include "tests/bench/swing.h"

namespace cuda_check {

using ode_parallel_sap::Box;
using ode_parallel_sap::BoxSet;

namespace {

// From -0.1 to 0.1, the same for a box and an axis every time.
float speedOf(std::size_t box, int axis) {
  std::uint64_t bits = (box * 3 + static_cast<std::uint64_t>(axis) + 1) * 0x9e3779b97f4a7c15u;
  bits ^= bits >> 32;
  bits *= 0xd6e8feb86659fd93u;
  return static_cast<float>(static_cast<double>(bits >> 40) * 0x1p-24 * 0.2 - 0.1);
}

}  // namespace

Motion::Motion(BoxSet& boxes)
    : boxes_(boxes), places_(boxes.boxes.begin(), boxes.boxes.begin() + boxes.size) {}

void Motion::advance() {
  const float way = static_cast<float>(bench::swing(++frame_));
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < places_.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const float lower = places_[i].lower[axis], upper = places_[i].upper[axis];
      const float step = way * speedOf(i, axis) * (upper - lower);
      if (!std::isfinite(step)) continue;
      boxes_.boxes[i].lower[axis] = lower + step;
      boxes_.boxes[i].upper[axis] = upper + step;
    }
}

}  // namespace cuda_check
