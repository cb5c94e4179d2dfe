// A frame on one device or on several.
#pragma once

#include <cstddef>
#include <vector>

#include "cuda/one/device_sweep.h"
#include "space/base/box_set.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

// Devices that find the pairs of a scene together, driven by the calling thread. Each reads all
// boxes over its own link and puts them in order, and each searches a part of the cells. Then each
// takes the pairs of the slots that are its own from all others, and sends their lists. So the
// sequence of pairs is that of one device, and the host does no more than for one.
//
// All have to come to the same cells: devices of one generation do, whose arithmetic is the same.
// They can read each other's memory (linkDevices). One may stand for several.
class DeviceGroup {
 public:
  explicit DeviceGroup(std::vector<DeviceSweep*> members) : members_(std::move(members)) {}

  // Has boxes [first, last), which do not change any more, on their way for a find() to come while
  // others are still made. `boxes` has storage for all of them, which stays until then, or until
  // the members have been made to wait(). Boxes that are not those after the last ones are left to
  // find(), with all that follow. Throws as find() does.
  void bring(const BoxSet& boxes, std::size_t first, std::size_t last);
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
  void begin(const BoxSet& boxes);
  bool haveBrought(std::size_t boxes) const;
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
