// sweep-count SET BOXES FRAMES
//
// For a tool that counts instructions (count.py): the inner loops of the sweep find the pairs of a
// dense cube of boxes FRAMES times, on one thread and with the instruction set SET. Prints the
// pairs of a frame; ends with 77 where the processor lacks the set.
#include <cstdio>
#include <cstdlib>

#include "space/base/floating_point.h"
#include "space/base/round_to_floats.h"
#include "space/pairs/sweep.h"
#include "space/simd/kernels.h"
#include "support/scenes.h"

using namespace ode_parallel_sap;

namespace {

BoxSet denseCube(std::size_t n) {
  BoxSet set;
  set.size = n;
  set.boxes.resize(n);
  set.exact = true;
  const sap_test::Boxes scene = sap_test::denseCube(n, 1);
  for (std::size_t i = 0; i < n; ++i) {
    double bounds[6];
    for (int axis = 0; axis < 3; ++axis) {
      bounds[2 * axis] = scene[i].low[axis];
      bounds[2 * axis + 1] = scene[i].high[axis];
    }
    set.exact = !(roundToFloats<double>(bounds, set.boxes[i]) & inexact_bounds) && set.exact;
  }
  return set;
}

// Boxes of one size are one tree: what is missing shows in the number of pairs.
std::size_t pairsOf(const BoxSet& boxes, int frames) {
  const ScopedMode mode(exactMode());
  Sweep<float> sweep;
  Buffer<std::uint64_t> workspace;
  sweep.build(boxes, 1, workspace);
  const CellTrees<float>& trees = sweep.trees();
  RowTable rows;
  PairList pairs;
  for (int frame = 0; frame < frames; ++frame) {
    rows.start(boxes.size, 1);
    for (std::size_t i = 0; i < trees.count(); ++i)
      kernels<float>().findPairs({trees.views(), trees.count(), i, 0, trees.cells(i)},
                                 rows.blocks(0));
    rows.writePairs(boxes.exact, 1, nullptr, pairs);
  }
  return pairs.size();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: %s SET BOXES FRAMES\n", argv[0]);
    return 2;
  }
  const KernelSet* const set = kernelSetNamed(argv[1]);
  if (!set) return 77;
  chooseKernelSet(*set);
  std::printf("%zu\n", pairsOf(denseCube(std::strtoul(argv[2], nullptr, 10)), std::atoi(argv[3])));
  return 0;
}
