// A stable parallel sort of 64-bit records by some of their bits.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {

// Sorts records[0..count) by bits [low_bit, low_bit + bits). `scratch` has room for as many.
void radixSort(std::uint64_t* records, std::uint64_t* scratch, std::size_t count, int low_bit,
               int bits, int threads);

}  // namespace ode_parallel_sap
