// Going through a list by turns of several stretches.
#pragma once

#include <cstddef>

#include "space/data/mechanisms.h"
#include "space/sort/tuning.h"

namespace ode_parallel_sap {

// Calls use(item) for all items, in an order that depends on their number alone. Pairs that were
// found one after the other often have one earlier slot and with it one counter, which a processor
// cannot add to before it has seen what it wrote there last; by turns, neighbours have different
// ones.
template <class T, class Use>
inline void interleave(const T* items, std::size_t count, Use use) {
  const std::size_t length = mechanisms::interleaved_pairs ? count / stretches : 0;
  for (std::size_t i = 0; i < length; ++i)
    for (std::size_t stretch = 0; stretch < stretches; ++stretch) use(items[stretch * length + i]);
  for (std::size_t i = stretches * length; i < count; ++i) use(items[i]);
}

}  // namespace ode_parallel_sap
