// The search on the device: every cell meets the cells ahead of it that its bounds reach.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "cuda/one/cells.h"
#include "cuda/one/scene_plan.h"

namespace ode_parallel_sap {
namespace device {

// A pair as it is found: the earlier slot, then the word that goes into its list: the later slot
// and, lowest, whether only the exact boxes can tell. Words in ascending order are lists in order.
using Found = unsigned long long;
constexpr Found nothing_found = ~Found{0};  // fills places that were taken but not needed

// What the search reads beside the boxes, by slot. Null: not filtered by it.
struct SearchFilter {
  const uint2* bits;  // category, collide
  const std::uint64_t* bodies;
};

struct SearchRules {
  SearchFilter filter;
  Part part;             // of the cells that are searched
  bool exact;            // no pair is borderline
  bool ignore_clusters;  // or else nothing is done in a clustered scene
};

// A row for each slot, where the first words of its list go as they are found, in no order.
struct Rows {
  std::uint32_t* words;
  std::uint32_t length;  // of a row
};

// Room for pairs as they are found: what is beyond its slot's row goes to `pairs`.
struct FoundPairs {
  Rows rows;
  Found* pairs;
  unsigned long long capacity;
};
// Places behind that capacity, into which goes what does not fit.
constexpr std::size_t overflow_places = chunk_places;

// Finds the pairs of each searched cell with itself and those ahead. They go into found.rows and,
// what is beyond, into found.pairs, as far as there is room; counters.found places are taken for
// these. Adds up in counts[] the pairs of each earlier slot, all of them whatever the capacity.
void findPairs(const CellStore& cells, const SearchRules& rules, ScenePlan* plan,
               const FoundPairs& found, std::uint32_t* counts, const KernelQueue& queue);

}  // namespace device
}  // namespace ode_parallel_sap
