#include "cuda/one/download.h"

#include <algorithm>
#include <atomic>

#include "cuda/device/spin.h"
#include "cuda/one/expand.h"
#include "cuda/one/lists.h"
#include "space/data/grains.h"
#include "space/data/parallel.h"

namespace ode_parallel_sap {

using device::stretch_words;

namespace {

constexpr std::size_t least_piece_stretches = 64;
constexpr std::size_t most_piece_stretches = 384;
constexpr std::size_t pieces_wanted = 6;

Region expanding("device: download");

}  // namespace

std::size_t Download::pieceWords(std::size_t total) {
  return std::max(least_piece_stretches,
                  std::min(most_piece_stretches, total / stretch_words / pieces_wanted)) *
         stretch_words;
}

Download::Download() {
  for (std::size_t i = 0; i < ring_pieces; ++i) here_.push_back(std::make_unique<Event>());
}

// Thread 0 asks for pieces, waits for them and tells the others; a piece of the ring is asked for
// again once all threads are done with it.
int Download::run(const std::uint32_t* stretches, std::size_t total,
                  const std::vector<std::unique_ptr<Event>>& ready, const std::uint32_t* has_list,
                  bool exact, int threads, cudaStream_t stream, PairList& pairs) {
  pairs.clear(1);
  pairs.parts[0].resizeDiscarding(total);
  if (total == 0) return 1;
  const std::size_t piece_words = pieceWords(total);
  const std::size_t piece_size = device::stretchedSize(piece_words);
  ring_.reserve(most_piece_stretches * device::stretch_size * ring_pieces);
  Pair* const to = pairs.parts[0].data();
  const std::size_t pieces = piecesFor(total);
  threads = teamFor(total, grains::received_words, threads);
  if (unsure_.size() < static_cast<std::size_t>(threads)) unsure_.resize(threads);
  for (auto& stretches : unsure_) stretches.clear();

  const auto ask = [&](std::size_t piece) {
    const std::size_t words = std::min(piece_words, total - piece * piece_words);
    const std::size_t place = piece % ring_pieces;
    CHECK_CUDA(cudaStreamWaitEvent(stream, *ready[piece], 0));
    CHECK_CUDA(cudaMemcpyAsync(ring_.data() + place * piece_size, stretches + piece * piece_size,
                               device::stretchedEnd(words) * sizeof(std::uint32_t),
                               cudaMemcpyDeviceToHost, stream));
    CHECK_CUDA(cudaEventRecord(*here_[place], stream));
  };
  std::vector<std::atomic<int>> expanded(pieces);
  std::atomic<std::size_t> arrived{0};
  std::atomic<bool> failed{false};
  int used = 1;
  runTeam(expanding, threads, [&](int thread, int team) {
    try {
      std::size_t asked = 0;
      for (std::size_t piece = 0; piece < pieces; ++piece) {
        if (thread == 0) {
          used = team;
          // A place of the ring is free again when the piece that it held is expanded.
          const auto isFree = [&] {
            return asked < ring_pieces || expanded[asked - ring_pieces].load() == team;
          };
          if (asked == piece) spinUntil([&] { return isFree() || failed.load(); });
          if (failed) return;
          while (asked < pieces && asked < piece + ring_pieces && isFree()) ask(asked++);
          CHECK_CUDA(cudaEventSynchronize(*here_[piece % ring_pieces]));
          arrived.store(piece + 1, std::memory_order_release);
        } else {
          spinUntil([&] {
            return arrived.load(std::memory_order_acquire) > piece ||
                   failed.load(std::memory_order_relaxed);
          });
          if (failed) return;
        }
        const std::size_t base = piece * piece_words, words = std::min(piece_words, total - base);
        const Range part = ownPart((words + stretch_words - 1) / stretch_words, thread, team);
        const std::uint32_t* const here = ring_.data() + piece % ring_pieces * piece_size;
        for (std::size_t stretch = part.begin; stretch < part.end; ++stretch) {
          const std::size_t begin = stretch * stretch_words;
          const std::size_t end = std::min(begin + stretch_words, words);
          if (expandStretch(here + stretch * device::stretch_size, end - begin, has_list,
                            to + base + begin) &&
              !exact)
            noteUnsure(to, {0, base + begin, base + end}, unsure_[thread]);
        }
        expanded[piece].fetch_add(1, std::memory_order_release);
      }
    } catch (...) {
      failed = true;
      throw;
    }
  });
  for (const auto& stretches : unsure_)
    pairs.unsure.insert(pairs.unsure.end(), stretches.begin(), stretches.end());
  return used;
}

}  // namespace ode_parallel_sap
