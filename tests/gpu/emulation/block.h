// The threads of a kernel's block, one after the other on the calling thread: each runs until it
// has to wait for others. Blocks run one after the other, too.
#pragma once

#include <vector_types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace emulation {

constexpr int warp_lanes = 32;
using LaneValues = std::array<std::uint64_t, warp_lanes>;

// Calls body() once for each thread of `blocks` blocks. The warps of a block come in an order that
// is another one each time. `threads` is at most 1024; those of the last warp may be few, unless
// they exchange values.
void runBlocks(std::size_t blocks, int threads, const std::function<void()>& body);

// Of the thread that runs, for the time of runBlocks.
const uint3& threadIndex();
const uint3& blockIndex();
const dim3& gridSize();
int lane();

// Waits for all threads of the block that have not ended.
void waitForBlock();
// The same; whether any of them says so.
bool anyOfBlock(bool own);
// Waits for all lanes of the warp, and returns what each has given: valid until this lane's next
// call.
const LaneValues& exchange(std::uint64_t own);

}  // namespace emulation
