#include "cuda/one/upload.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "cuda/device/spin.h"
#include "space/data/grains.h"
#include "space/data/parallel.h"

namespace ode_parallel_sap {

namespace {

// Pieces travel in about 30 us at full speed: long enough to hide what starting one costs, short
// enough that the first leaves soon.
constexpr std::size_t most_piece_bytes = 3 << 19;
constexpr std::size_t least_piece_bytes = 1 << 19;
constexpr std::size_t pieces_wanted = 4;
// From this many threads on one does nothing but send.
constexpr int least_team_with_sender = 4;
// In the long run more threads copy no faster and keep the device from reading (16 threads and an
// H200: 39 instead of 47 GB/s); what is short is there sooner.
constexpr int most_copiers = 6;
constexpr std::size_t long_run_bytes = std::size_t{8} << 20;

Region sending("device: upload");

}  // namespace

Upload::Upload() : in_use_(ring_pieces, false) {
  for (std::size_t i = 0; i < ring_pieces; ++i) gone_.push_back(std::make_unique<Event>());
}

// Piece by piece, each thread copies its part. Thread 0 opens pieces of the ring as they become
// free, several ahead, and sends those whose parts are all there; from a few threads on it copies
// nothing itself, so that nobody waits for the calls.
int Upload::run(const void* from, void* to, std::size_t bytes, std::size_t element, int threads,
                cudaStream_t stream, const std::function<void(std::size_t, std::size_t)>& sent) {
  if (bytes == 0) return 1;
  ring_.reserve(most_piece_bytes * ring_pieces);
  const std::size_t piece_bytes =
      std::min(most_piece_bytes, std::max(least_piece_bytes, bytes / pieces_wanted)) / element *
      element;
  const std::size_t pieces = (bytes + piece_bytes - 1) / piece_bytes;
  threads = teamFor(bytes, grains::sent_bytes, threads);
  const int copiers = bytes < long_run_bytes ? threads : most_copiers;
  std::vector<std::atomic<int>> copied(pieces);
  std::atomic<std::size_t> open{0};  // pieces that may be written; all once something failed
  const std::size_t first = next_;
  const auto placeOf = [first](std::size_t piece) { return (first + piece) % ring_pieces; };
  const auto sizeOf = [&](std::size_t piece) {
    return std::min(piece_bytes, bytes - piece * piece_bytes);
  };
  const auto copyPart = [&](std::size_t piece, int part, int parts) {
    const Range range = ownPart(sizeOf(piece), part, parts, 64);
    std::memcpy(ring_.data() + placeOf(piece) * most_piece_bytes + range.begin,
                static_cast<const char*>(from) + piece * piece_bytes + range.begin,
                range.end - range.begin);
    copied[piece].fetch_add(1, std::memory_order_release);
  };
  const auto send = [&](std::size_t piece) {
    const std::size_t begin = piece * piece_bytes, place = placeOf(piece);
    CHECK_CUDA(cudaMemcpyAsync(static_cast<char*>(to) + begin,
                               ring_.data() + place * most_piece_bytes, sizeOf(piece),
                               cudaMemcpyHostToDevice, stream));
    CHECK_CUDA(cudaEventRecord(*gone_[place], stream));
    in_use_[place] = true;
    sent(begin, begin + sizeOf(piece));
  };
  // Opens what is free of the pieces that are not sent yet; waits only for the next one.
  const auto openUpTo = [&](std::size_t sent_pieces) {
    std::size_t opened = open.load(std::memory_order_relaxed);
    while (opened < pieces && opened < sent_pieces + ring_pieces) {
      const std::size_t place = placeOf(opened);
      if (in_use_[place]) {
        if (opened > sent_pieces) {
          const cudaError_t status = cudaEventQuery(*gone_[place]);
          if (status == cudaErrorNotReady) break;
          CHECK_CUDA(status);
        } else {
          CHECK_CUDA(cudaEventSynchronize(*gone_[place]));
        }
        in_use_[place] = false;
      }
      open.store(++opened, std::memory_order_release);
    }
  };
  int used = 1;
  runTeam(sending, threads, [&](int thread, int team) {
    if (thread == 0) used = team;
    const bool apart = team >= least_team_with_sender;
    const int parts = apart ? std::min(team - 1, copiers) : team;
    if (apart && thread > parts) return;
    if (thread != 0) {
      for (std::size_t piece = 0; piece < pieces; ++piece) {
        spinUntil([&] { return open.load(std::memory_order_acquire) > piece; });
        copyPart(piece, apart ? thread - 1 : thread, parts);
      }
      return;
    }
    try {
      for (std::size_t piece = 0; piece < pieces; ++piece) {
        openUpTo(piece);
        if (!apart) copyPart(piece, 0, parts);
        spinUntil([&] { return copied[piece].load(std::memory_order_acquire) == parts; });
        send(piece);
      }
    } catch (...) {
      open.store(pieces, std::memory_order_release);
      throw;
    }
  });
  next_ = (first + pieces) % ring_pieces;
  return used;
}

}  // namespace ode_parallel_sap
