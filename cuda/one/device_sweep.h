// The stages of one frame on one device, from boxes that have come to lists that can leave. The
// finders decide how boxes come and how lists leave.
#ifndef ODE_PARALLEL_SAP_CUDA_DEVICE_SWEEP_H
#define ODE_PARALLEL_SAP_CUDA_DEVICE_SWEEP_H

#include <cstddef>
#include <cstdint>
#include <memory>

#include "cuda/one/cells.h"
#include "cuda/one/context.h"
#include "space/data/pair_list.h"

namespace ode_parallel_sap {

// Calls come in the order begin, arrived..., start, finish, sortLists; or release at any time.
// The device is current for the calling thread. All but release throw DeviceFailure.
class DeviceSweep {
 public:
  // What is in a frame. Without `shared` box i is that of slot i.
  struct Frame {
    std::size_t slots = 0;
    std::size_t boxes = 0;  // on this device
    bool filter_bits = false, filter_bodies = false, exact = false;
    device::Share share;  // which pairs are this device's
  };

  explicit DeviceSweep(int device) : device_(device) {}
  ~DeviceSweep() { release(); }
  DeviceSweep(const DeviceSweep&) = delete;
  DeviceSweep& operator=(const DeviceSweep&) = delete;

  int device() const { return device_; }
  // To be made current for all calls but release().
  DriverContext driverContext();
  // Null before begin() and after release().
  Context* context() { return context_.get(); }
  const Context* context() const { return context_.get(); }

  // Room for up to `boxes` boxes to come.
  void begin(std::size_t boxes);
  // Boxes [first, last) are on their way on the stream `up`. They are counted by bin when they have
  // come.
  void arrived(std::size_t first, std::size_t last);
  // Everything up to where the pairs are in their lists; the host need not wait. Without shares and
  // filters it is replayed in one call where frames repeat themselves. With filters, sendFilters is
  // called once the boxes are being put in order.
  template <class SendFilters>
  void start(const Frame& frame, SendFilters sendFilters) {
    frame_ = frame;
    reserve();
    if (frame.filter_bits || frame.filter_bodies || frame.share.slot_of || measuring) {
      order();
      if (frame.filter_bits || frame.filter_bodies) sendFilters();
      search(false);
    } else {
      startRecorded();
    }
    collect();
  }
  // Waits for the number of pairs and makes sure that all were found.
  void finish();
  std::size_t pairs() const;
  // Sorts the lists, in the order in which they leave. Words [i, i + 1) * piece_words of them may
  // leave after context()->ready[i].
  void sortLists(std::size_t piece_words);
  // The same, and brings them as pairs to where they belong: the one part of `pairs`, which has
  // room for them and is locked. Waits until all are there.
  void sendPairs(PairList& pairs);

  // Marks the end of a stage, while measuring.
  void mark(Stage stage);
  bool measuring = false;

  // Gives back all that is on the device. Nothing is under way any more then.
  void release();

 private:
  void reserve();
  void reservePairs(std::size_t pairs);
  void order();
  void buildCells();
  bool divideClusters(int round);
  void search(bool ignore_clusters);
  void startRecorded();
  void collect();
  template <class Sorted>
  void sortInPieces(const device::Lists& lists, std::size_t piece_words, Sorted sorted);
  device::CellStore cellStore();
  device::FoundPairs foundPairs();
  bool findAll();
  std::size_t blocks() const {
    return (frame_.slots + device::list_block - 1) / device::list_block;
  }

  const int device_;
  DriverContext driver_context_ = nullptr;
  std::unique_ptr<Context> context_;
  Frame frame_;
  std::size_t pairs_expected_ = 0;
  device::DoubleBuffer<std::uint32_t> keys_ = {}, slots_ = {};
  // The same after the sort, which leaves its result in either array; and after the sort that is
  // replayed.
  device::DoubleBuffer<std::uint32_t> sorted_keys_ = {}, sorted_slots_ = {};
  device::DoubleBuffer<std::uint32_t> recorded_keys_ = {}, recorded_slots_ = {};
  device::DoubleBuffer<std::uint64_t> long_keys_ = {};
};

}  // namespace ode_parallel_sap

#endif
