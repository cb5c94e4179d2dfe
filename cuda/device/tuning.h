// The tuned constants of work on devices, for all of cuda/.
#pragma once

#include <cstddef>

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

// What several devices pass on to each other at a time, at least: 60 us at full speed hide what
// starting a piece costs. Unit: bytes. A round number.
constexpr std::size_t piece_bytes = 3 << 20;

}  // namespace device
}  // namespace ode_parallel_sap
