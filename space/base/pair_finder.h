// What every method of finding pairs implements, on whatever back end.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <stdexcept>

#include "space/base/box_set.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// The most bytes that the paper's lists of a scene may take, on each device. 0, but in tests: half
// of what is free.
inline std::atomic<std::uint64_t> most_list_bytes{0};

// They need more memory than they may take. Both in bytes.
class ListsTooLong : public std::runtime_error {
 public:
  ListsTooLong(std::uint64_t needed, std::uint64_t allowed)
      : std::runtime_error("the lists of pairs are too long"), needed(needed), allowed(allowed) {}
  std::uint64_t needed, allowed;
};

// Reads boxes of a frame while others are still made.
class BoxReader {
 public:
  // Boxes [first, last) do not change any more. They come in their order, from the first on, and
  // have storage for all of the frame, which stays until the pairs are found or forget() returns.
  virtual void read(const BoxSet& boxes, std::size_t first, std::size_t last) = 0;
  // There will be no pairs of them.
  virtual void forget() = 0;

 protected:
  ~BoxReader() = default;
};

class PairFinder {
 public:
  virtual ~PairFinder() = default;

  // Puts into `pairs`, ascending and each once, every pair of slots whose boxes overlap (closed
  // intervals, NaN overlaps nothing), which passes the filters of `boxes` and which `test` keeps.
  // It decides about pairs that float boxes cannot decide about; without it they stay, and carry
  // borderline_bit. Uses up to `threads` threads; returns the number used. Throws std::bad_alloc
  // where memory ends.
  virtual int find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) = 0;
  int find(const BoxSet& boxes, int threads, PairList& pairs) {
    return find(boxes, threads, pairs, nullptr);
  }

  // Bytes held from one frame to the next.
  virtual std::size_t bytes() const = 0;
};

}  // namespace ode_parallel_sap
