// The kernels for the `Lanes` that the including file has. Everything here has internal linkage:
// each including file is compiled for an instruction set of its own, and no function of it may be
// shared with, or replaced by, another file's.
#pragma once

#include "space/simd/kernel_cells.h"
#include "space/simd/kernel_halves.h"
#include "space/simd/kernel_kept_pairs.h"
#include "space/simd/kernel_rows.h"

namespace {

template <class Real>
constexpr Kernels<Real> kernelsFor() {
  return {packCells<Real>,  packBounds<Real>,  findPairs<Real>, testLater<Real>,
          findInTree<Real>, findInCells<Real>, meetRay<Real>};
}

constexpr KernelSet kernel_set = {Lanes::name,  kernelsFor<float>(), kernelsFor<double>(),
                                  boxesOutside, keptPairs,           cutIntoCells,
                                  writeRows};

}  // namespace
