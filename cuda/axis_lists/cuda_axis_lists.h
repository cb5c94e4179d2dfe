// The paper's lists of pairs on one or several CUDA devices, as the rest of the library sees them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "space/base/pair_finder.h"

namespace ode_parallel_sap {

// How long the stages of the last find() took, in milliseconds on the host's clock.
struct CudaAxisListsTimes {
  double endpoints = 0;  // on the CPU: end points sorted, pairs of each axis counted
  double devices = 0;    // scene cut and sent, pairs found and fetched, all devices
  double finish = 0;     // on the CPU: filters, marks, order
};

// Finds what AxisLists finds on the CPU (space/paper/axis_lists.h), in floats and in
// doubles. Not for use by two threads at once; several finders may share devices. After an
// exception the finder may be destroyed or used again.
class CudaAxisListsFinder : public PairFinder {
 public:
  // Throws DeviceFailure, ListsTooLong (for the memory of one of the devices) and std::bad_alloc.
  // One thread drives each device, as far as `threads` allows.
  int find(const BoxSet& boxes, int threads, PairList& pairs) override = 0;
  // Host memory only.
  std::size_t bytes() const override = 0;
  virtual std::size_t deviceBytes() const = 0;
  // These devices share the work from now on, each an equal part of the pairs of the fullest axis;
  // one may be named twice.
  virtual void useDevices(const std::vector<int>& devices) = 0;
  virtual const CudaAxisListsTimes& times() const = 0;
};

// A finder on device 0. Touches neither driver nor device; the first find() does.
std::unique_ptr<CudaAxisListsFinder> makeCudaAxisLists();

}  // namespace ode_parallel_sap
