// The stages of one frame on one device, from boxes that have come to lists that can leave. Whoever
// has devices do a frame (cuda/several/device_group.h) decides how boxes come and how lists leave.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/one/cells.h"
#include "cuda/one/context.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Calls come in the order open, begin, bring..., setFilters, openPairs, order and search or
// orderAndSearch, isDone until it is true, then sendPairs and finishPairs; or release at any time.
// The device is current for the calling thread. All but wait and release throw DeviceFailure.
class DeviceSweep : public OnDevice<Context> {
 public:
  using OnDevice::OnDevice;

  std::size_t slots() const { return frame_.boxes; }

  // How long rows should be, by what learn() was told last.
  std::uint32_t wantedRow() const;
  // Room for the boxes to come, box i that of slot i. All parts' rows are of one length.
  void begin(const BoxSet& boxes, const device::Part& part, std::uint32_t row_length);
  // Brings the boxes up to the last-th, which do not change any more, and counts them by bin.
  void bring(const BoxSet& boxes, std::size_t last);
  // How many are on their way, of a frame whose filters are not set yet.
  std::size_t brought() const { return brought_; }
  std::size_t parts() const { return frame_.part.count; }
  void setFilters(const BoxSet& boxes);
  // The search waits for these, not order().
  void bringFilters(const BoxSet& boxes);
  // Once all boxes are on their way. The host need not wait.
  void order();
  // Finds the pairs of the part; with no others, puts them into their lists, too.
  void search();
  // Both, replayed in one call where frames repeat themselves. Not for filters.
  void orderAndSearch();
  // Of a part: finds the places of those lists that are the device's own, from what all parts have
  // counted.
  void listOwn(const device::PartCounts& counts);
  // Waits for the numbers of pairs. False if the search has to be made again: for want of places,
  // of which there are enough then, or in a cluster.
  bool isDone();
  // Places taken by pairs beyond the rows, some of them empty, and pairs in the lists that are the
  // device's own.
  std::size_t found() const { return context_->host_counters[0].found; }
  std::size_t pairs() const { return context_->host_counters[0].pairs; }
  bool isClustered() const { return context_->host_counters[0].clustered != 0; }
  // When it is done: how many pairs all parts have found together.
  void learn(std::size_t all_pairs) {
    pairs_a_slot_ = static_cast<double>(all_pairs) / static_cast<double>(frame_.boxes);
  }
  // Makes the search again, of all parts. Clusters are divided first, `round` times so far, or
  // ignored.
  bool divideClusters(int round);
  void searchAgain(bool ignore_clusters);
  // Of a part: room for its own pairs, then takes those that a part, this one or another, has
  // found into its lists, in the order in which listOwn was given the counts, before any list is
  // sorted.
  void reserveOwn() { context_->lists.reserve(pairs()); }
  void takePairs(const DeviceSweep& of);

  // Where pairs are to go, from before the search on: they do so at once if they have room, and if
  // this is the second time in a row.
  void openPairs(const Buffer<Pair>& to);
  // Sorts the lists and sends them as pairs to a part of `pairs`, which has room for them.
  // finishPairs waits until all are there.
  void sendPairs(PairList& pairs, std::size_t part);
  void finishPairs(PairList& pairs, std::size_t part);

  // Marks the end of a stage, while measuring; and how long all of them took.
  void mark(DeviceStage stage);
  void readTimes();
  CudaStageTimes* times = nullptr;  // null: not measured

  // Waits for all that is under way, whatever becomes of it, and forgets the boxes.
  void wait();

 private:
  // What is in a frame.
  struct Frame {
    std::size_t boxes = 0;
    bool filter_bits = false, filter_bodies = false, exact = false;
    device::Part part;  // of the scene, which pairs are this device's
    bool isShared() const { return part.count > 1; }
  };
  // fixed: guesses, before anything is known of the scene; there are never fewer places.
  static constexpr double first_pairs_a_slot = 5;
  static constexpr std::size_t least_places_a_box = 8;

  template <class Value>
  void bringFilter(const Buffer<Value>& from, DeviceBuffer<Value>& to, PageLock& lock);
  void follow(cudaStream_t later, cudaStream_t earlier);
  void reserve();
  void reservePairs(std::size_t pairs, std::size_t beyond);
  void buildCells();
  void search(bool ignore_clusters);
  void summarise(const std::uint32_t* counts);
  void collect();
  void sortShortLists();
  device::Found* sortedPairs();
  std::size_t sortedPlaces() const;
  device::Lists lists();
  device::CellStore cellStore();
  device::FoundPairs foundPairs();
  device::OpenLists openLists();
  device::Rows rows() { return {context_->rows.data(), row_length_}; }

  Frame frame_;
  std::size_t brought_ = 0;
  // From the last search, with a quarter more: pairs, and places taken by those beyond the rows.
  // And how many pairs a slot has, of all parts together.
  std::size_t pairs_expected_ = 0, beyond_expected_ = 0;
  double pairs_a_slot_ = first_pairs_a_slot;
  std::uint32_t row_length_ = 0;
  device::ListRows list_rows_ = {};  // of all parts, where there are several
  // Of the host's list, and those that there were when lists were sorted last.
  std::size_t host_places_ = 0, places_sorted_ = 0;
  std::uint32_t* slots_ = nullptr;  // one of the context's: in their order
};

}  // namespace ode_parallel_sap
