// A frame on one device or on several.
#pragma once

#include <cstddef>
#include <vector>

#include "cuda/one/device_sweep.h"
#include "space/base/box_set.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Devices that find the pairs of a scene together, driven by the calling thread. Each brings a
// slice of the boxes over its own link and passes it on to the others, so that all have all boxes;
// all put them in order, and each searches a part of the cells. Then each takes the pairs of the
// slots that are its own from all others, and sends their lists. So the sequence of pairs is that
// of one device, and the host does no more than for one.
//
// All have to come to the same cells: devices of one generation do, whose arithmetic is the same.
// One may stand for several.
class DeviceGroup {
 public:
  explicit DeviceGroup(std::vector<DeviceSweep*> members) : members_(std::move(members)) {}

  // Fills a part of `pairs` for each member. Throws DeviceFailure of the member failed(), and
  // std::bad_alloc; nothing is under way then, and the members have given back all they had.
  void find(const BoxSet& boxes, PairList& pairs);
  std::size_t failed() const { return current_; }

 private:
  bool isShared() const { return members_.size() > 1; }
  template <class Work>
  void each(Work work);
  template <class Work>
  void eachOther(std::size_t of, Work work);
  void link();
  template <class Value>
  struct Array;
  template <class Value, class Send, class Arrived>
  void bring(const Array<Value>& array, Send send, Arrived arrived);
  template <class Value, class Send, class Arrived>
  void bringSlices(const Array<Value>& array, int round, int rounds, Send send, Arrived arrived);
  template <class Value, class ValuesOf, class Use>
  void readOthers(std::size_t index, DeviceBuffer<Value>& copies, ValuesOf valuesOf, Use use);
  void bringBoxes(const BoxSet& boxes);
  void bringFilters(const BoxSet& boxes);
  void search(const BoxSet& boxes);
  void shareCounts();
  void sharePairs();
  bool divideClusters(int round);
  void complete();
  void giveUp();
  void fetch(PairList& pairs);

  const std::vector<DeviceSweep*> members_;
  std::size_t current_ = 0;
};

}  // namespace ode_parallel_sap
