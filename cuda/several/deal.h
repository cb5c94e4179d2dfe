// Deals the boxes of a scene to the devices that share it.
#ifndef ODE_PARALLEL_SAP_CUDA_DEAL_H
#define ODE_PARALLEL_SAP_CUDA_DEAL_H

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "cuda/device/device.h"
#include "cuda/one/device_sweep.h"
#include "cuda/several/partition.h"
#include "space/data/box_set.h"

namespace ode_parallel_sap {

// One device's boxes on their way: a stream of boxes without gaps, cut into pieces. Any thread
// takes a place in the stream and writes boxes to it; the device's own thread, its driver, sends
// the pieces that are full. A ring of pinned pieces is small enough to stay in the processor's
// cache.
//
// A thread that waits for room holds a place in this stream only, and the pieces ahead of it are
// written by threads that hold earlier places: as long as the driver drives, nobody waits for ever.
class DealStream {
 public:
  // By the driver, its device current, before any box is put. The others may have begun to wait.
  void open(DeviceSweep& sweep, const BoxSet& boxes);
  // Once no thread is in put() any more, or before the first.
  void reset();
  // Lets everyone go on without this device.
  void giveUp() { lost_.store(true, std::memory_order_release); }
  bool isLost() const { return lost_.load(std::memory_order_acquire); }

  // Of the row-th DealtRow::slots slots, those of `share` are this device's.
  // Calls wait() again and again while there is no room.
  template <class Wait>
  void put(const BoxSet& boxes, std::size_t row, const DealtRow& dealt, std::size_t share,
           Wait wait);

  // By the driver: sends what is full, and when `all_put` the rest. Never waits. True when all has
  // been sent.
  bool drive(bool all_put);
  // By the driver, then: lets the device number its boxes. They are there for what comes next on
  // its stream `compute`.
  void finish(const BoxSet& boxes);
  std::size_t boxes() const { return static_cast<std::size_t>(taken_.load()); }
  std::size_t bytes() const {
    return ring_.bytes() + bits_.bytes() + bodies_.bytes() + members_.bytes() + firsts_.bytes();
  }

 private:
  static constexpr std::size_t ring_pieces = device::ring_pieces;
  static constexpr std::size_t piece_boxes = device::piece_bytes / sizeof(Box);

  void write(const BoxSet& boxes, Slot first_slot, const std::uint16_t* at, std::size_t count,
             std::size_t to);
  void send(std::size_t piece, std::size_t count);

  DeviceSweep* sweep_ = nullptr;
  bool with_bits_ = false, with_bodies_ = false;
  PinnedBuffer<Box> ring_;
  PinnedBuffer<FilterBits> bits_;
  PinnedBuffer<std::uint32_t> bodies_;
  PinnedBuffer<std::uint32_t> members_, firsts_;
  std::vector<std::unique_ptr<Event>> gone_;  // one a piece of the ring
  std::size_t sent_ = 0, in_use_ = 0;         // pieces; those before in_use_ have left the ring

  alignas(64) std::atomic<std::uint64_t> taken_{0};                   // places in the stream
  alignas(64) std::atomic<std::uint64_t> opened_{0};                  // pieces that may be written
  alignas(64) std::atomic<std::uint32_t> written_[ring_pieces] = {};  // boxes of each piece
  std::atomic<bool> lost_{false};
};

template <class Wait>
void DealStream::put(const BoxSet& boxes, std::size_t row, const DealtRow& dealt, std::size_t share,
                     Wait wait) {
  const std::uint16_t* const at = dealt.at[share];
  const std::size_t count = dealt.count[share];
  const auto isOpen = [&](std::uint64_t piece) {
    while (opened_.load(std::memory_order_acquire) <= piece) {
      if (lost_.load(std::memory_order_acquire)) return false;
      wait();
    }
    return true;
  };
  if (!isOpen(0)) return;
  const std::uint64_t first = taken_.fetch_add(count, std::memory_order_relaxed);
  firsts_[row] = static_cast<std::uint32_t>(first);
  constexpr std::size_t words = DealtRow::slots / 32;
  std::copy_n(dealt.members[share], words, members_.data() + row * words);
  for (std::size_t done = 0; done < count;) {
    const std::uint64_t to = first + done, piece = to / piece_boxes;
    const std::size_t part = std::min<std::size_t>(count - done, (piece + 1) * piece_boxes - to);
    if (!isOpen(piece)) return;
    const std::size_t place = piece % ring_pieces * piece_boxes + to % piece_boxes;
    write(boxes, static_cast<Slot>(row * DealtRow::slots), at + done, part, place);
    written_[piece % ring_pieces].fetch_add(static_cast<std::uint32_t>(part),
                                            std::memory_order_release);
    done += part;
  }
}

}  // namespace ode_parallel_sap

#endif
