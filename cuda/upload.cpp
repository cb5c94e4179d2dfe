#include "upload.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "../space/parallel.h"
#include "spin.h"

namespace ode_parallel_sap {

namespace {

// Pieces travel in about 30 us at full speed: long enough to hide what starting one costs, short
// enough that the first leaves soon.
constexpr std::size_t most_piece_bytes = 3 << 19;
constexpr std::size_t least_piece_bytes = 1 << 17;
constexpr std::size_t pieces_wanted = 6;
// A thread is not worth waking for less.
constexpr std::size_t least_bytes_a_thread = 1 << 16;

}  // namespace

Upload::Upload() : in_use_(ring_pieces, false) {
  for (std::size_t i = 0; i < ring_pieces; ++i) gone_.push_back(std::make_unique<Event>());
}

// Piece by piece, each thread copies its part; thread 0 also opens pieces of the ring, waits for
// the parts of the others and sends.
int Upload::run(const void* from, void* to, std::size_t bytes, std::size_t element, int threads,
                cudaStream_t stream, const std::function<void(std::size_t, std::size_t)>& sent) {
  if (bytes == 0) return 1;
  ring_.reserve(most_piece_bytes * ring_pieces);
  const std::size_t piece_bytes =
      std::min(most_piece_bytes, std::max(least_piece_bytes, bytes / pieces_wanted)) / element *
      element;
  const std::size_t pieces = (bytes + piece_bytes - 1) / piece_bytes;
  threads = static_cast<int>(
      std::max<std::size_t>(1, std::min<std::size_t>(threads, bytes / least_bytes_a_thread)));

  std::vector<std::atomic<int>> copied(pieces);
  std::atomic<std::size_t> open{0};  // pieces that may be written; all once something failed
  const std::size_t first = next_;
  int used = 1;
  runTeam(threads, [&](int thread, int team) {
    if (thread == 0) used = team;
    try {
      for (std::size_t piece = 0; piece < pieces; ++piece) {
        const std::size_t place = (first + piece) % ring_pieces;
        if (thread == 0) {
          if (in_use_[place]) CHECK_CUDA(cudaEventSynchronize(*gone_[place]));
          open.store(piece + 1, std::memory_order_release);
        } else {
          spinUntil([&] { return open.load(std::memory_order_acquire) > piece; });
        }
        const std::size_t begin = piece * piece_bytes;
        const std::size_t size = std::min(piece_bytes, bytes - begin);
        char* const staged = ring_.data() + place * most_piece_bytes;
        const Range part = partOf(size, thread, team, 64);
        std::memcpy(staged + part.begin, static_cast<const char*>(from) + begin + part.begin,
                    part.end - part.begin);
        copied[piece].fetch_add(1, std::memory_order_release);
        if (thread != 0) continue;
        spinUntil([&] { return copied[piece].load(std::memory_order_acquire) == team; });
        CHECK_CUDA(cudaMemcpyAsync(static_cast<char*>(to) + begin, staged, size,
                                   cudaMemcpyHostToDevice, stream));
        CHECK_CUDA(cudaEventRecord(*gone_[place], stream));
        in_use_[place] = true;
        sent(begin, begin + size);
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
