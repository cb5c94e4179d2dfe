// Brings the sorted lists to the host and makes pairs of them while more arrive.
#ifndef ODE_PARALLEL_SAP_CUDA_DOWNLOAD_H
#define ODE_PARALLEL_SAP_CUDA_DOWNLOAD_H

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "cuda/device/device.h"
#include "cuda/one/scene_plan.h"
#include "space/data/pair_list.h"

namespace ode_parallel_sap {

class Download {
 public:
  // `total` words travel in pieces of this many, whole stretches: 1.5 MB at most, as in Upload, and
  // several pieces where that pays, so that the first can be dealt with early.
  static std::size_t pieceWords(std::size_t total);
  static std::size_t piecesFor(std::size_t total) {
    return (total + pieceWords(total) - 1) / pieceWords(total);
  }

  Download();
  // Fills `pairs` with one part of `total` pairs from their stretches on the device. Piece i may be
  // copied once the i-th of `ready` has happened; has_list (expand.h) is there by then if it was
  // asked for on `stream`. `exact`: no pair is unsure. Returns the number of threads used.
  int run(const std::uint32_t* stretches, std::size_t total,
          const std::vector<std::unique_ptr<Event>>& ready, const std::uint32_t* has_list,
          bool exact, int threads, cudaStream_t stream, PairList& pairs);
  std::size_t bytes() const { return ring_.bytes(); }

 private:
  static constexpr std::size_t ring_pieces = 8;

  PinnedBuffer<std::uint32_t> ring_;
  std::vector<std::unique_ptr<Event>> here_;            // one a piece of the ring
  std::vector<std::vector<PairList::Stretch>> unsure_;  // one a thread
};

}  // namespace ode_parallel_sap

#endif
