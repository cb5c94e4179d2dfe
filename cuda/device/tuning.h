// The tuned constants of work on devices, for all of cuda/.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {
namespace device {

// Threads of a block: eight such blocks fill a processor, and shared memory holds what they share.
// Unit: threads. From: cuda/check time, all scenes.
// Doubled: the paper's lists of 20,000 boxes take 1.16 times as long. Halved: no difference.
constexpr int block_threads = 256;

// Blocks of a kernel whose threads take items in strides: as many as a processor holds at once.
constexpr int blocks_a_processor = 8;

// Items that a thread takes before there are that many blocks: what a block prepares is worth it.
constexpr int items_a_thread = 4;

// The sweep.

// More boxes than this with one key are a cluster: its cells would have no order, and each would
// meet all others.
constexpr std::uint32_t cluster_size = 1024;

// Up to this number of boxes the sort is spared the last eight digits of keys, which leaves some
// keys to a cell.
constexpr std::size_t most_short_keys = std::size_t{1} << 21;

// Blocks of the search that a processor holds: the compiler keeps to the registers that leaves.
constexpr int search_blocks_a_processor = 4;

// Places for pairs that a warp takes at a time: few takers meet at the counter, and what the last
// ones leave empty stays small.
constexpr std::uint32_t chunk_places = 256;

// Cells whose boxes are loaded together, to wait for memory once.
constexpr int cells_at_once = 2;

// Places in each slot's row for its first words, for each pair that slots have on average. Earlier
// slots have more later ones: up to twice as many.
constexpr std::size_t row_places_a_pair = 3;

// Rows are no longer than this. A round number.
constexpr std::uint32_t most_row = 64;

// The paper's lists.

// Pairs of an axis list that a thread looks up: what a block found goes out together, from 16 kB of
// shared memory.
constexpr int pairs_a_thread = 8;

}  // namespace device
}  // namespace ode_parallel_sap
