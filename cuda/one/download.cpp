#include "cuda/one/download.h"

#include <algorithm>
#include <atomic>

#include "cuda/device/spin.h"
#include "cuda/one/expand.h"
#include "cuda/one/lists.h"
#include "cuda/one/tuning.h"
#include "space/base/parallel.h"
#include "space/base/team.h"

namespace ode_parallel_sap {

using namespace device;

namespace {

Region expanding("device: download");

// Words that are expanded to pairs: half of the smallest piece that is asked for at once.
constexpr Grain grain_words = {least_piece_segments * segment_words / 2, Grain::whole};

std::size_t wordsOf(const Download::Lists& lists, std::size_t piece) {
  const std::size_t words = Download::pieceWords(lists.words);
  return std::min(words, lists.words - piece * words);
}

}  // namespace

std::size_t Download::pieceWords(std::size_t total) {
  return std::clamp(total / segment_words / pieces_wanted, least_piece_segments, piece_segments) *
         segment_words;
}

Download::Download() {
  for (std::size_t i = 0; i < ring_pieces; ++i) here_.push_back(std::make_unique<Event>());
}

std::uint32_t* Download::ringOf(const Lists& lists, std::size_t piece) {
  return ring_.data() + piece % ring_pieces * segmentedSize(pieceWords(lists.words));
}

void Download::copy(const Lists& lists, std::size_t piece, cudaStream_t stream) {
  CHECK_CUDA(cudaStreamWaitEvent(stream, *lists.ready[piece], 0));
  CHECK_CUDA(cudaMemcpyAsync(
      ringOf(lists, piece), lists.segments + piece * segmentedSize(pieceWords(lists.words)),
      segmentedEnd(wordsOf(lists, piece)) * sizeof(std::uint32_t), cudaMemcpyDeviceToHost, stream));
  CHECK_CUDA(cudaEventRecord(*here_[piece % ring_pieces], stream));
}

void Download::ask(const Lists& lists, std::size_t piece, cudaStream_t stream) {
  if (piece == 0) ring_.reserve(piece_segments * segment_size * ring_pieces);
  if (piece < ring_pieces) copy(lists, piece, stream);
}

// Lists on their way, piece by piece. Each thread makes pairs of its part of a piece.
class Download::Transfer {
 public:
  Transfer(Download& download, const Lists& lists, cudaStream_t stream, PairList& pairs,
           std::size_t part)
      : download_(download),
        lists_(lists),
        stream_(stream),
        to_(pairs.parts[part].data()),
        part_(part),
        piece_words_(pieceWords(lists.words)),
        pieces_(piecesFor(lists.words)),
        expanded_(pieces_) {}

  // Waits for pieces and tells the others; a place of the ring is asked for again once all threads
  // are done with its piece.
  void drive(int team) {
    std::size_t asked = std::min(pieces_, ring_pieces);
    const auto isFree = [&] { return expanded_[asked - ring_pieces].load() == team; };
    for (std::size_t piece = 0; piece < pieces_; ++piece) {
      if (asked == piece) spinUntil([&] { return isFree() || failed_.load(); });
      if (failed_) return;
      while (asked < pieces_ && asked < piece + ring_pieces && isFree())
        download_.copy(lists_, asked++, stream_);
      CHECK_CUDA(cudaEventSynchronize(*download_.here_[piece % ring_pieces]));
      arrived_.store(piece + 1, std::memory_order_release);
      expand(piece, 0, team);
    }
  }
  void follow(int thread, int team) {
    for (std::size_t piece = 0; piece < pieces_; ++piece) {
      spinUntil([&] {
        return arrived_.load(std::memory_order_acquire) > piece ||
               failed_.load(std::memory_order_relaxed);
      });
      if (failed_) return;
      expand(piece, thread, team);
    }
  }
  // A thread cannot go on: nor can the others.
  void fail() { failed_ = true; }

 private:
  void expand(std::size_t piece, int thread, int team) {
    const std::size_t base = piece * piece_words_, words = wordsOf(lists_, piece);
    const Range part = ownPart((words + segment_words - 1) / segment_words, thread, team);
    const std::uint32_t* const here = download_.ringOf(lists_, piece);
    for (std::size_t segment = part.begin; segment < part.end; ++segment) {
      const std::size_t begin = segment * segment_words;
      const std::size_t end = std::min(begin + segment_words, words);
      if (expandSegment(here + segment * segment_size, end - begin, lists_.has_list,
                        to_ + base + begin) &&
          !lists_.exact)
        noteBorderline(to_, {part_, base + begin, base + end}, download_.borderline_[thread]);
    }
    expanded_[piece].fetch_add(1, std::memory_order_release);
  }

  Download& download_;
  const Lists lists_;
  const cudaStream_t stream_;
  Pair* const to_;
  const std::size_t part_, piece_words_, pieces_;
  std::vector<std::atomic<int>> expanded_;  // threads that are done with each piece
  std::atomic<std::size_t> arrived_{0};     // pieces
  std::atomic<bool> failed_{false};
};

int Download::run(const Lists& lists, int threads, cudaStream_t stream, PairList& pairs,
                  std::size_t part) {
  if (lists.words == 0) return 1;
  threads = teamFor(lists.words, grain_words, threads);
  if (borderline_.size() < static_cast<std::size_t>(threads)) borderline_.resize(threads);
  for (auto& segments : borderline_) segments.clear();
  Transfer transfer(*this, lists, stream, pairs, part);
  int used = 1;
  runTeam(expanding, threads, [&](int thread, int team) {
    if (thread == 0) used = team;
    try {
      if (thread == 0)
        transfer.drive(team);
      else
        transfer.follow(thread, team);
    } catch (...) {
      transfer.fail();
      throw;
    }
  });
  for (const auto& segments : borderline_)
    pairs.borderline.insert(pairs.borderline.end(), segments.begin(), segments.end());
  return used;
}

}  // namespace ode_parallel_sap
