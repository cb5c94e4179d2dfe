// Brings the sorted lists to the host and makes pairs of them while more arrive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "cuda/device/device.h"
#include "cuda/one/scene_plan.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

class Download {
 public:
  // `total` words travel in pieces of this many, whole segments: as large as in Upload.
  static std::size_t pieceWords(std::size_t total);
  static std::size_t piecesFor(std::size_t total) {
    return (total + pieceWords(total) - 1) / pieceWords(total);
  }

  Download();
  // Sorted lists on the device.
  struct Lists {
    const std::uint32_t* segments;
    std::size_t words;
    const std::vector<std::unique_ptr<Event>>& ready;  // piece i may be copied after the i-th
    const std::uint32_t* has_list;  // (expand.h) there by then if it was asked for on the stream
    bool exact;                     // no pair is borderline
  };

  // Asks for a piece of which the device has been told how to make it ready; one after the other,
  // from the first one on. Does nothing for those that have no place in the ring yet.
  void ask(const Lists& lists, std::size_t piece, cudaStream_t stream);
  // Fills a part of `pairs`, which has room for them, when all pieces that have a place were asked
  // for. Returns the number of threads used.
  int run(const Lists& lists, int threads, cudaStream_t stream, PairList& pairs, std::size_t part);
  std::size_t bytes() const { return ring_.bytes(); }

 private:
  class Transfer;

  void copy(const Lists& lists, std::size_t piece, cudaStream_t stream);
  std::uint32_t* ringOf(const Lists& lists, std::size_t piece);

  PinnedBuffer<std::uint32_t> ring_;
  std::vector<std::unique_ptr<Event>> here_;                // one a piece of the ring
  std::vector<std::vector<PairList::Segment>> borderline_;  // one a thread
};

}  // namespace ode_parallel_sap
