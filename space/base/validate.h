// Invariants that run. Each room has its own in a file validate.cpp, which only tests compile.
#pragma once

#include <cstddef>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Whether validate() of each room is called in every frame.
#if defined(ODE_PARALLEL_SAP_VALIDATE)
constexpr bool validates = true;
#else
constexpr bool validates = false;
#endif

// fixed: slots whose pairs are tested one by one, which takes as long as a frame.
constexpr std::size_t most_validated = 300;

// Ends the program with the sentence of an invariant that does not hold.
void mustHold(bool holds, const char* invariant);

// The list has the pairs of slots for which isPair(earlier, later) is true, and unless `exactly`
// perhaps others.
template <class IsPair>
void mustBePairs(const PairList& pairs, std::size_t slots, bool exactly, IsPair isPair,
                 const char* invariant) {
  if (slots > most_validated) return;
  std::vector<Pair> list;
  for (const PairList::Run& run : pairs.runs) list.insert(list.end(), run.begin(), run.end());
  auto next = list.begin();
  for (Slot a = 0; a < slots; ++a)
    for (Slot b = a + 1; b < slots; ++b) {
      const bool is_listed = next != list.end() && *next == makePair(a, b);
      next += is_listed;
      if (exactly || !is_listed) mustHold(is_listed == isPair(a, b), invariant);
    }
  mustHold(next == list.end(), invariant);
}

}  // namespace ode_parallel_sap
