// The tuned constants of the sweep on one device.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {
namespace device {

// More boxes than this with one key are a cluster: its cells would have no order, and each would
// meet all others. Unit: boxes. From: cuda/check time, one place and log sizes.
// Doubled: no difference. Halved: no difference.
constexpr std::uint32_t cluster_size = 1024;

// Up to this number of boxes the sort is spared the last eight digits of keys, which leaves some
// keys to a cell.
// Unit: boxes. From: cuda/check time, cube of 1,000,000 and 4,000,000.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t most_short_keys = std::size_t{1} << 21;

// Blocks of the search that a processor holds: the compiler keeps to the registers that leaves.
// Unit: blocks a processor. From: cuda/check time, all scenes.
// Doubled: no difference. Halved: no difference.
constexpr int search_blocks_a_processor = 4;

// Places for pairs that a warp takes at a time: few takers meet at the counter, and what the last
// ones leave empty stays small.
// Unit: pairs. From: cuda/check time, all scenes.
// Doubled: no difference. Halved: no difference.
constexpr std::uint32_t chunk_places = 256;

// Cells whose boxes are loaded together, to wait for memory once.
// Unit: cells. From: cuda/check time, cube.
// Doubled: no difference. Halved: no difference.
constexpr int cells_at_once = 2;

// The lists of the first so many pairs are sorted before the host knows that all were found, which
// saves it a way to the device. The others are sorted in pieces, while these travel.
// Unit: pairs. From: cuda/check cells, cubes of 10,000 (0.95 of the time) to 1,000,000.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t most_sorted_at_once = std::size_t{1} << 20;

// Places in each slot's row for its first words, for each pair that slots have on average. Earlier
// slots have more later ones: up to twice as many.
// Unit: places a pair. From: cuda/check time, all scenes.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t row_places_a_pair = 3;

// Where rows would have to be longer there are none: most lists are, which takes longer with rows
// (6,000 boxes in one spot: 1.5 times).
// Unit: places. From: cuda/check time, one place.
// Doubled: no difference. Halved: no difference.
constexpr std::uint32_t most_row = 64;

// What travels is cut into so many pieces at least, unless they were smaller than
// least_piece_bytes: the first can be dealt with early.
// Unit: pieces. From: cuda/check time, cube of 100,000.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t pieces_wanted = 4;

// Pieces of a ring of pinned memory, which stays in the processor's cache.
// Unit: pieces. From: cuda/check time, cube of 1,000,000.
// Doubled: no difference. Halved: no difference.
constexpr std::size_t ring_pieces = 8;

// From this many threads a device on one of them does nothing but drive it.
// Unit: threads a device. From: cuda/check time, 2 to 16 threads.
// Doubled: no difference. Halved: no difference.
constexpr int threads_with_driver_apart = 4;

// Up to this number of threads pairs travel as such, where their storage can be locked: 8 bytes
// that no thread has to expand, in place of 4. On 6 threads 1.72 ms in place of 1.87, on 12 in
// place of 1.53.
// Unit: threads. From: cuda/check time, cube of 1,000,000.
// Doubled: no difference. Halved: no difference.
constexpr int most_fetching_in_place = 8;

}  // namespace device
}  // namespace ode_parallel_sap
