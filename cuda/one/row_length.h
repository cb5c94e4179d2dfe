// How long the rows are into which pairs go as they are found.
#pragma once

#include <algorithm>
#include <cstdint>

#include "cuda/one/tuning.h"

namespace ode_parallel_sap {
namespace device {

// fixed: a row is whole sectors of memory.
constexpr std::uint32_t least_row = 8;

// Where lists have so many pairs on average, of which `parts` devices find some each: the last
// length, which spares the frame a new graph, unless it is too short or four times too long. Where
// lists are long there are no rows: 0. Most pairs of a slot are found by the part that has its
// cell, so that more parts than two need no shorter rows. Rows of several parts are half as long as
// of one: 6 % of the pairs are beyond them then. Longer ones were not timed.
inline std::uint32_t rowLengthFor(double pairs_a_slot, std::uint32_t parts, std::uint32_t last) {
  const double alone = pairs_a_slot * row_places_a_pair;
  if (alone > most_row) return 0;
  const double wanted = parts > 1 ? alone / 2 : alone;
  if (last >= wanted && last <= std::max<double>(least_row, 4 * wanted)) return last;
  std::uint32_t length = least_row;
  while (length < wanted) length *= 2;
  return length;
}

}  // namespace device
}  // namespace ode_parallel_sap
