// The paper's lists of pairs on one or several CUDA devices. No CUDA type in here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/pair_list.h"
#include "space/paper/axis_lists.h"

namespace ode_parallel_sap {

// Finds what AxisLists finds on the CPU (space/paper/axis_lists.h), in floats and in
// doubles. Not for use by two threads at once; several finders may share devices. After an
// exception the finder may be destroyed or used again.
class CudaAxisLists final : public PairFinder {
 public:
  // On device 0. Touches neither driver nor device; the first find() does.
  CudaAxisLists();
  ~CudaAxisLists() override;

  // Throws DeviceFailure, ListsTooLong (for the memory of one of the devices) and std::bad_alloc.
  // One thread drives each device, as far as `threads` allows.
  using PairFinder::find;
  int find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) override;
  // Host memory only.
  std::size_t bytes() const override;
  // These devices share the work from now on, each an equal part of the pairs of the fullest axis;
  // one may be named twice.
  void useDevices(const std::vector<int>& devices);

 private:
  struct Share;  // what belongs to one device
  int findOnDevices(int threads);
  void finish(const BoxSet& boxes, int threads, const PairTest* test, PairList& pairs);

  AxisRows rows_[3];
  std::vector<Share> shares_;
  RowTable finished_;
};

}  // namespace ode_parallel_sap
