#include "cuda/one/upload.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "cuda/device/spin.h"
#include "cuda/one/tuning.h"
#include "space/base/parallel.h"
#include "space/base/team.h"

namespace ode_parallel_sap {

using namespace device;

namespace {

Region sending("device: upload");

// Bytes that are copied to where a device reads them: 50 us at the 8 GB/s that each of six threads
// reaches.
constexpr Grain grain_bytes = {least_piece_bytes, Grain::whole};

// Of a piece of the array, in whole elements.
std::size_t pieceBytes(const Upload::Array& array, std::size_t most) {
  const std::size_t bytes = std::clamp(array.bytes / array.pieces, least_piece_bytes, most);
  return bytes / array.element * array.element;
}

}  // namespace

Upload::Upload() : in_use_(ring_pieces, false) {
  for (std::size_t i = 0; i < ring_pieces; ++i) gone_.push_back(std::make_unique<Event>());
}

// An array on its way, piece by piece. Each thread copies its part of a piece into the ring.
class Upload::Transfer {
 public:
  Transfer(Upload& upload, const Array& array, cudaStream_t stream, const Sent& sent)
      : upload_(upload),
        array_(array),
        stream_(stream),
        sent_(sent),
        own_piece_bytes_(pieceBytes(array, piece_bytes)),
        pieces_((array.bytes + own_piece_bytes_ - 1) / own_piece_bytes_),
        copied_(pieces_) {}

  std::size_t pieces() const { return pieces_; }

  // Copies a part of each piece.
  void copy(int part, int parts) {
    for (std::size_t piece = 0; piece < pieces_; ++piece) {
      spinUntil([&] { return open_.load(std::memory_order_acquire) > piece; });
      copyPart(piece, part, parts);
    }
  }
  // Opens pieces of the ring as they become free, several ahead, and sends those whose parts are
  // all there; copies the first part itself unless it is to do nothing but that.
  void drive(int parts, bool apart) {
    try {
      for (std::size_t piece = 0; piece < pieces_; ++piece) {
        openFrom(piece);
        if (!apart) copyPart(piece, 0, parts);
        spinUntil([&] { return copied_[piece].load(std::memory_order_acquire) == parts; });
        send(piece);
      }
    } catch (...) {
      open_.store(pieces_, std::memory_order_release);
      throw;
    }
  }

 private:
  std::size_t placeOf(std::size_t piece) const { return (upload_.next_ + piece) % ring_pieces; }
  std::size_t sizeOf(std::size_t piece) const {
    return std::min(own_piece_bytes_, array_.bytes - piece * own_piece_bytes_);
  }
  char* ringOf(std::size_t piece) { return upload_.ring_.data() + placeOf(piece) * piece_bytes; }

  void copyPart(std::size_t piece, int part, int parts) {
    const Range range = ownPart(sizeOf(piece), part, parts, 64);
    std::memcpy(ringOf(piece) + range.begin,
                static_cast<const char*>(array_.from) + piece * own_piece_bytes_ + range.begin,
                range.end - range.begin);
    copied_[piece].fetch_add(1, std::memory_order_release);
  }
  void send(std::size_t piece) {
    const std::size_t begin = piece * own_piece_bytes_, place = placeOf(piece);
    CHECK_CUDA(cudaMemcpyAsync(static_cast<char*>(array_.to) + begin, ringOf(piece), sizeOf(piece),
                               cudaMemcpyHostToDevice, stream_));
    CHECK_CUDA(cudaEventRecord(*upload_.gone_[place], stream_));
    upload_.in_use_[place] = true;
    sent_(begin, begin + sizeOf(piece));
  }
  // Opens what is free of the pieces from `next` on, which are not sent yet; waits only for the
  // first of them.
  void openFrom(std::size_t next) {
    std::size_t opened = open_.load(std::memory_order_relaxed);
    while (opened < pieces_ && opened < next + ring_pieces) {
      const std::size_t place = placeOf(opened);
      if (upload_.in_use_[place]) {
        if (opened > next) {
          const cudaError_t status = cudaEventQuery(*upload_.gone_[place]);
          if (status == cudaErrorNotReady) break;
          CHECK_CUDA(status);
        } else {
          CHECK_CUDA(cudaEventSynchronize(*upload_.gone_[place]));
        }
        upload_.in_use_[place] = false;
      }
      open_.store(++opened, std::memory_order_release);
    }
  }

  Upload& upload_;
  const Array array_;
  const cudaStream_t stream_;
  const Sent& sent_;
  const std::size_t own_piece_bytes_, pieces_;
  std::vector<std::atomic<int>> copied_;  // parts of each piece
  std::atomic<std::size_t> open_{0};      // pieces that may be written; all once something failed
};

namespace {

void sendInPlace(const Upload::Array& array, cudaStream_t stream, const Upload::Sent& sent) {
  const std::size_t step = pieceBytes(array, std::max(array.bytes, piece_bytes));
  for (std::size_t begin = 0; begin < array.bytes; begin += step) {
    const std::size_t end = std::min(begin + step, array.bytes);
    CHECK_CUDA(cudaMemcpyAsync(static_cast<char*>(array.to) + begin,
                               static_cast<const char*>(array.from) + begin, end - begin,
                               cudaMemcpyHostToDevice, stream));
    sent(begin, end);
  }
}

}  // namespace

// Thread 0 drives; from a few threads on it copies nothing itself, so that nobody waits for the
// calls.
int Upload::run(const Array& array, int threads, cudaStream_t stream, const Sent& sent) {
  if (array.bytes == 0) return 1;
  if (array.locked) {
    sendInPlace(array, stream, sent);
    return 1;
  }
  ring_.reserve(piece_bytes * ring_pieces);
  Transfer transfer(*this, array, stream, sent);
  threads = teamFor(array.bytes, grain_bytes, threads);
  int used = 1;
  runTeam(sending, threads, [&](int thread, int team) {
    if (thread == 0) used = team;
    const bool apart = team >= threads_with_driver_apart;
    const int parts = apart ? team - 1 : team, part = apart ? thread - 1 : thread;
    if (thread == 0)
      transfer.drive(parts, apart);
    else
      transfer.copy(part, parts);
  });
  next_ = (next_ + transfer.pieces()) % ring_pieces;
  return used;
}

}  // namespace ode_parallel_sap
