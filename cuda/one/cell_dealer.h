// Which cells a warp of the search takes. For kernels and host.
#pragma once

#include <cstdint>

#include "cuda/one/scene_plan.h"
#include "space/base/both_sides.h"

namespace ode_parallel_sap {
namespace device {

// Deals the cells of a part to the warps of a grid, by number. Three quarters are dealt in strides,
// so that a block's warps have neighbours, which reach the same boxes; the others to whoever is
// done, as how long one takes differs. Of 1,000,000 and 4,000,000 boxes the search takes 1.1 and
// 1.05 times the time with all in strides, 1.03 and 1.16 with all to whoever is done.
class CellDealer {
 public:
  // fixed: neighbours that go to the same part, as many as a block of the search has warps.
  static constexpr std::uint32_t together = 8;

  ODE_PARALLEL_SAP_BOTH_SIDES CellDealer(const Part& part, std::uint32_t cells, std::uint32_t warps)
      : part_(part), stride_(warps), in_strides_(cells / part.count / 4 * 3) {}

  // The cell with that number in the part's row; there is none if it is not below their number, and
  // none behind it either.
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t cellOf(std::uint32_t dealt) const {
    const std::uint32_t group = dealt / together * part_.count + part_.index;
    return group * together + dealt % together;
  }
  // A warp's first number is its own. The next one after `dealt` is a stride on, unless that leaves
  // those that are dealt in strides: then it asks, and gets that of the `asked`-th who does.
  ODE_PARALLEL_SAP_BOTH_SIDES bool isInStrides(std::uint32_t dealt) const {
    return dealt < in_strides_;
  }
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t after(std::uint32_t dealt) const {
    return dealt + stride_;
  }
  ODE_PARALLEL_SAP_BOTH_SIDES std::uint32_t forAsking(std::uint32_t asked) const {
    return (in_strides_ > stride_ ? in_strides_ : stride_) + asked;
  }

 private:
  const Part part_;
  const std::uint32_t stride_, in_strides_;
};

}  // namespace device
}  // namespace ode_parallel_sap
