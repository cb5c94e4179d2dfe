// Brings plain arrays from the host's memory to the device.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "cuda/device/device.h"

namespace ode_parallel_sap {

// Locked arrays travel from where they are. Others do through a ring of pinned pieces: threads copy
// into one while others travel. The ring is small enough to stay in the processor's cache.
class Upload {
 public:
  Upload();
  struct Array {
    const void* from;
    void* to;  // on the device
    std::size_t bytes;
    std::size_t element;  // bytes of one; pieces hold whole ones
    std::size_t pieces;   // wanted: what has come can be worked on
    bool locked;          // in memory (cuda/device/page_locks.h)
  };
  using Sent = std::function<void(std::size_t, std::size_t)>;

  // Copies an array. sent(begin, end) is called by the calling thread once the copy of that range
  // of bytes has been asked for on `stream`. Returns when all copies have been asked for, with the
  // number of threads used. A locked array is to stay as it is until they are done.
  int run(const Array& array, int threads, cudaStream_t stream, const Sent& sent);
  std::size_t bytes() const { return ring_.bytes(); }

 private:
  class Transfer;

  PinnedBuffer<char> ring_;
  std::vector<std::unique_ptr<Event>> gone_;  // one a piece of the ring
  std::vector<bool> in_use_;
  std::size_t next_ = 0;
};

}  // namespace ode_parallel_sap
