// The pairs that many threads find, gathered by their earlier slots and put in order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// Threads put pairs into blocks, by chunks of earlier slots. Then the pairs of a chunk become the
// rows of its slots, which are ordered one by one: the order is the report's, whoever found them.
class RowTable {
 public:
  void start(std::size_t slots, int threads);
  // Where a kernel of that thread puts pairs.
  RowBlocks& blocks(int thread) { return *blocks_[thread]; }
  // Adds a pair, which may be marked as borderline, on that thread.
  void add(int thread, Pair pair) {
    Blocks& blocks = *blocks_[thread];
    const std::size_t chunk = earlierOf(pair) >> chunk_bits_;
    std::uint64_t* to = blocks.ends[chunk];
    if (reinterpret_cast<std::uintptr_t>(to) % row_block_bytes == 0) to = blocks.addBlock(chunk);
    *to = Pair{earlierOf(pair)} << 33 | Pair{laterOf(pair)} << 1 | Pair{isMarkedBorderline(pair)};
    blocks.ends[chunk] = to + 1;
  }
  // Leaves the pairs that so many threads found and that the test keeps, in order, in the first
  // part of `pairs`; unless `exact`, borderline ones may be marked. Returns the number of threads
  // used.
  int writePairs(bool exact, int threads, const PairTest* test, PairList& pairs);
  std::size_t bytes() const { return bytesOf(blocks_, chunk_begin_, chunks_); }

 private:
  // A thread's own storage.
  struct alignas(64) Blocks final : RowBlocks {
    std::uint64_t* addBlock(std::size_t chunk) override;
    std::size_t pairsOf(std::size_t chunk) const;
    template <class Use>
    void forPairs(std::size_t chunk, Use use) const;
    std::size_t bytes() const { return bytesOf(ends, block_counts, storage, words, row_ends); }

    Buffer<std::uint64_t*> ends;                 // of pairs, by chunk
    Buffer<std::uint32_t> block_counts;          // by chunk
    std::vector<Buffer<std::uint64_t>> storage;  // of blocks
    std::size_t storage_used = 0, room = 0;      // blocks that the last one used has left
    // To write the pairs of chunks.
    Buffer<std::uint32_t> words, row_ends;
  };

  bool writeChunk(std::size_t chunk, bool exact, int threads, Blocks& blocks, Pair* begin,
                  Pair* end);

  std::size_t slots_ = 0;
  int chunk_bits_ = 0;
  std::vector<std::unique_ptr<Blocks>> blocks_;
  Buffer<std::size_t> chunk_begin_;
  Buffer<PairList::Run> chunks_;  // their pairs
};

}  // namespace ode_parallel_sap
