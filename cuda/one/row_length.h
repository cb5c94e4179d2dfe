// How long the rows are into which pairs go as they are found.
#pragma once

#include <algorithm>
#include <cstdint>

#include "cuda/one/tuning.h"

namespace ode_parallel_sap {
namespace device {

// fixed: a row is whole sectors of memory.
constexpr std::uint32_t least_row = 8;

// Where lists have so many pairs on average: the last length, which spares the frame a new graph,
// unless it is too short or four times too long. Where lists are long there are no rows: 0. Rows of
// several devices are as long as of one, since the device that has a slot's cell finds most of its
// pairs.
inline std::uint32_t rowLengthFor(double pairs_a_slot, std::uint32_t last) {
  const double wanted = pairs_a_slot * row_places_a_pair;
  if (wanted > most_row) return 0;
  if (last >= wanted && last <= std::max<double>(least_row, 4 * wanted)) return last;
  std::uint32_t length = least_row;
  while (length < wanted) length *= 2;
  return length;
}

}  // namespace device
}  // namespace ode_parallel_sap
