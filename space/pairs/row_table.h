// The rows of a frame's boxes, found by many threads, and the pairs made of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// Every row is found by one thread, complete and in order, and stays where that thread put it. So a
// walk over the slots meets all pairs in the order of the report, whoever found them.
template <class Real>
class RowTable {
 public:
  // Makes ready for the rows of a frame.
  void start(std::size_t slots, int threads);
  // Where a kernel of that thread puts rows.
  RowSpace<Real>& space(int thread) { return *spaces_[thread]; }
  // Leaves the pairs of all rows, which so many threads found and which the test keeps, in the
  // first part of `pairs`. Returns the number of threads used.
  int writePairs(bool exact, int threads, const PairTest* test, PairList& pairs);
  std::size_t bytes() const { return bytesOf(rows_, spaces_, chunk_begin_, chunks_); }

 private:
  // A thread's own storage.
  struct alignas(64) Space final : RowSpace<Real> {
    void start(std::size_t slots, Row* table);
    void growNear(std::size_t cells) override;
    void growWords(std::size_t words) override;
    void growRows(std::size_t words) override;
    std::size_t bytes() const {
      return bytesOf(near_bounds, near_numbers, scratch, blocks, pair_counts, slot_marks);
    }

    Buffer<Real> near_bounds;
    Buffer<std::uint32_t> near_numbers, scratch;
    Buffer<std::uint64_t> pair_counts;
    std::vector<Buffer<std::uint32_t>> blocks;  // of rows
    std::size_t blocks_used = 0;
    Buffer<std::uint64_t> slot_marks;
  };

  Buffer<Row> rows_;  // by slot
  std::vector<std::unique_ptr<Space>> spaces_;
  Buffer<std::size_t> chunk_begin_;
  Buffer<PairList::Run> chunks_;  // the pairs of row_chunk slots each
};

}  // namespace ode_parallel_sap
