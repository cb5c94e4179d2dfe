// Lets kernels write pairs into a buffer.
#pragma once

#include <algorithm>

#include "space/base/pair_list.h"
#include "space/base/tuning.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// Appends to `pairs`, which holds what was written once the sink is gone.
class BufferSink : public PairSink {
 public:
  static constexpr std::size_t first_capacity = chunk_pairs;

  explicit BufferSink(Buffer<Pair>& pairs) : pairs_(pairs) {
    grow = &BufferSink::growBuffer;
    point(pairs.size());
  }
  ~BufferSink() { pairs_.resize(next - pairs_.data()); }
  BufferSink(const BufferSink&) = delete;
  BufferSink& operator=(const BufferSink&) = delete;

 private:
  void point(std::size_t size) {
    next = pairs_.data() + size;
    end = pairs_.data() + pairs_.capacity();
  }
  static void growBuffer(PairSink& sink, std::size_t room) {
    BufferSink& self = static_cast<BufferSink&>(sink);
    const std::size_t size = self.next - self.pairs_.data();
    self.pairs_.resize(size);
    const std::size_t larger = self.pairs_.capacity() / 2 * 3;
    self.pairs_.reserve(std::max(std::max(std::size_t{first_capacity}, larger), size + room));
    self.point(size);
  }

  Buffer<Pair>& pairs_;
};

}  // namespace ode_parallel_sap
