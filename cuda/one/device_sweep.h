// The stages of one frame on one device, from boxes that have come to lists that can leave. Whoever
// has devices do a frame (cuda/several/device_group.h) decides how boxes come and how lists leave.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "cuda/one/cells.h"
#include "cuda/one/context.h"
#include "cuda/one/own_lists.h"
#include "space/data/pair_list.h"

namespace ode_parallel_sap {

// Calls come in the order begin, arrived..., order and search or orderAndSearch, isDone until it is
// true, then sortLists or sendPairs; or release at any time. The device is current for the calling
// thread. All but wait and release throw DeviceFailure.
class DeviceSweep {
 public:
  // What is in a frame. Box i is that of slot i.
  struct Frame {
    std::size_t boxes = 0;
    bool filter_bits = false, filter_bodies = false, exact = false;
    bool in_place = false;  // whether pairs are to travel as such (sendPairs), as far as is known
    device::Part part;      // of the scene, which pairs are this device's
    bool isShared() const { return part.count > 1; }
  };

  explicit DeviceSweep(int device) : device_(device) {}
  ~DeviceSweep() { release(); }
  DeviceSweep(const DeviceSweep&) = delete;
  DeviceSweep& operator=(const DeviceSweep&) = delete;

  int device() const { return device_; }
  // To be made current for all calls but wait() and release().
  DriverContext driverContext();
  // Null before begin() and after release().
  Context* context() { return context_.get(); }
  const Context* context() const { return context_.get(); }

  std::size_t slots() const { return frame_.boxes; }
  // Whether the last frame's pairs were sent as such.
  bool sentInPlace() const { return sent_in_place_; }

  // Room for the boxes to come.
  void begin(const Frame& frame);
  // Boxes [first, last) are on their way on that stream. They are counted by bin when they have
  // come.
  void arrived(std::size_t first, std::size_t last, cudaStream_t stream);
  // Once all boxes are on their way. The host need not wait.
  void order();
  // Finds the pairs of the part; with no others, their places in the lists, too.
  void search();
  // Both, replayed in one call where frames repeat themselves. Not for filters.
  void orderAndSearch();
  // Of a part: finds the places of those lists that are the device's own, from what all parts have
  // counted.
  void listOwn(const device::PartCounts& counts);
  // Waits for the numbers of pairs. False if the search has to be made again: for want of places,
  // of which there are enough then, or in a cluster.
  bool isDone();
  // Of pairs that found a place: here, and in the lists that are the device's own.
  std::size_t found() const;
  std::size_t pairs() const;
  bool isClustered() const;
  // Makes the search again, of all parts. Clusters are divided first, `round` times so far, or
  // ignored.
  bool divideClusters(int round);
  void searchAgain(bool ignore_clusters);
  // Of a part: room for its own pairs, then has those of the found ones, here or elsewhere, put
  // into their lists.
  void reserveOwn();
  void takePairs(const device::Found* found, std::size_t count);

  // Sorts the lists, in the order in which they leave. Words [i, i + 1) * piece_words of them may
  // leave after context()->ready[i].
  void sortLists(std::size_t piece_words);
  // The same, and sends them as pairs to where they belong: a part of `pairs`, which has room for
  // them and is locked. finishPairs waits until all are there.
  void sendPairs(PairList& pairs, std::size_t part);
  void finishPairs(PairList& pairs, std::size_t part);

  // Marks the end of a stage, while measuring.
  void mark(Stage stage);
  bool measuring = false;

  // Waits for all that is under way, whatever becomes of it.
  void wait();
  // Gives back all that is on the device. Nothing is under way any more then.
  void release();

 private:
  void reserve();
  void reservePairs(std::size_t pairs);
  void buildCells();
  void search(bool ignore_clusters);
  void list(const std::uint32_t* counts);
  void collect();
  void scatterUpTo(std::size_t block);
  void sortAll();
  void clearBorderline(std::size_t pairs);
  template <class Sorted>
  void sortInPieces(bool in_place, std::size_t piece_words, Sorted sorted);
  device::Lists lists(bool in_place);
  device::CellStore cellStore();
  device::FoundPairs foundPairs();
  DeviceBuffer<device::Found>& sortedPairs() {
    return frame_.isShared() ? context_->own_pairs : context_->found;
  }
  std::size_t blocks() const {
    return (frame_.boxes + device::list_block - 1) / device::list_block;
  }

  const int device_;
  DriverContext driver_context_ = nullptr;
  std::unique_ptr<Context> context_;
  Frame frame_;
  std::size_t pairs_expected_ = 0;
  // Blocks of slots: whose pairs are in their lists, and how many more at a time.
  std::size_t scattered_blocks_ = 0, pass_blocks_ = 1;
  bool sorted_ = false;  // all but the long lists, as the frame's in_place says
  bool sent_in_place_ = false;
  device::DoubleBuffer<std::uint32_t> keys_ = {}, slots_ = {};
  // The same after the sort, which leaves its result in either array; and after the sort that is
  // replayed.
  device::DoubleBuffer<std::uint32_t> sorted_keys_ = {}, sorted_slots_ = {};
  device::DoubleBuffer<std::uint32_t> recorded_keys_ = {}, recorded_slots_ = {};
  device::DoubleBuffer<std::uint64_t> long_keys_ = {};
};

}  // namespace ode_parallel_sap
