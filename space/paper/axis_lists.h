// Overlapping pairs of each axis as lists, and the pairs common to all three.
#pragma once

#include <cstdint>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_finder.h"
#include "space/pairs/pair_sort.h"
#include "space/paper/endpoint_lists.h"

namespace ode_parallel_sap {

// The system of Avril, Gouranton and Arnaldi ("Collision Detection: Broad Phase Adaptation from
// Multi-Core to Multi-GPU Architecture", section 5.1), on the CPU: boxes are sorted along each
// axis, all pairs that overlap on an axis become a list, and each pair of the longest list is
// looked up in the second one; what both hold is looked up in the third.
//
// A list has 4 bytes a pair, and a scene has n^(5/3) pairs an axis at least, n^2 in the worst case:
// the method is a yardstick. A pair's place in a list follows from the ranks of its boxes
// (AxisRows), so that a look-up reads one entry.
template <class Real>
class AxisLists : public PairFinder {
 public:
  // Throws ListsTooLong, with the boxes sorted and no memory taken for pairs.
  int find(const BoxSet& boxes, int threads, PairList& pairs) override;
  std::size_t bytes() const override { return bytesOf(endpoints_, lists_, found_, scratch_); }

 private:
  void reserveLists();
  void meet(const BoxSet& boxes, const AxisChoice& axes, std::uint64_t begin, std::uint64_t end,
            Buffer<Pair>& found) const;

  EndpointLists<Real> endpoints_;
  Buffer<Slot> lists_[3];
  std::vector<Buffer<Pair>> found_;  // one a thread
  Buffer<Pair> scratch_;             // to sort with
};

}  // namespace ode_parallel_sap
