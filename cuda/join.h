// From the lists of several devices to the pairs of the scene, in order. Plain host code.
#ifndef ODE_PARALLEL_SAP_CUDA_JOIN_H
#define ODE_PARALLEL_SAP_CUDA_JOIN_H

#include <cstddef>
#include <cstdint>
#include <vector>

#include "../space/buffer.h"
#include "../space/pair_list.h"
#include "partition.h"
#include "scene_plan.h"

namespace ode_parallel_sap {

// One device's sorted lists as they travel (scene_plan.h), by the slots of the whole scene.
struct ShareLists {
  const std::uint32_t* stretches = nullptr;
  const unsigned long long* begins = nullptr;  // words before each block of slots, and of all
  const std::uint32_t* has_list = nullptr;     // bit i: slot i has a list
};

// Blocks [begin, end) of list_block slots, whose pairs begin at place `pairs` of the result. They
// can be joined once `needed` words of each share have come.
struct Slice {
  std::size_t begin, end, pairs;
  unsigned long long needed[most_shares];
};

// Cuts `blocks` blocks into slices of about the same number of pairs, in the order in which they
// can be joined if words come equally fast from all devices.
std::vector<Slice> slicesOf(const ShareLists* shares, int count, std::size_t blocks);

// Joins slices. One for each thread.
class Joiner {
 public:
  // Writes the slice's pairs to their places in `to`. Unless `exact`, stretches
  // with unsure pairs are added to `unsure`.
  void join(const ShareLists* shares, int count, const Slice& slice, std::size_t slots, bool exact,
            Pair* to, std::vector<PairList::Stretch>& unsure);

 private:
  void gather(const ShareLists* shares, int count, const Slice& slice);
  static Pair* takeList(const std::uint32_t*& next, Slot slot, Pair* to, std::size_t room,
                        std::uint32_t& marks);
  Pair* mergeLists(const ShareLists* shares, int count, Slot slot, Pair* to, std::uint32_t& marks);

  Buffer<std::uint32_t> words_;                  // the slice's, share after share, each with an end
  const std::uint32_t* next_[most_shares] = {};  // where each share's next list begins
  std::vector<std::uint32_t> merged_, more_;
};

}  // namespace ode_parallel_sap

#endif
