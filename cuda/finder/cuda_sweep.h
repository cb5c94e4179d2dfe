// The sweep on CUDA devices, as the rest of the library sees it. No CUDA type in here.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "cuda/device/devices.h"
#include "space/base/pair_finder.h"

namespace ode_parallel_sap {

// How long the stages of the last find() took on the device, in milliseconds; filled only while
// measuring. The stages follow each other without a gap, except that boxes arrive during `upload`
// and pairs leave during `lists`.
struct CudaStageTimes {
  float upload = 0;      // first box sent until the last one is on the device
  float classify = 0;    // classes of sizes, keys
  float sort = 0;        // boxes along the curve
  float cells = 0;       // cells cut, packed and put into a tree
  float search = 0;      // pairs found
  float scan = 0;        // places of the lists
  float scatter = 0;     // pairs put into their lists
  float lists = 0;       // lists sorted
  float host_wait = 0;   // on the host: from the last box sent to the number of pairs known
  float host_pairs = 0;  // on the host: from there to the last pair written
  // Of several devices those of the first; `scan` and `scatter` include what they tell each other.
  // All stages from the last box's arrival to the last list sorted.
  float device() const { return classify + sort + cells + search + scan + scatter + lists; }
};

// The sweep on one or several devices. Finds what Sweep<float> finds. Not for use by two threads at
// once; finders may share devices.
class CudaPairFinder : public PairFinder {
 public:
  // Whether it can find the pairs of such boxes: not of doubles (BoxSet::wide).
  virtual bool takes(const BoxSet& boxes) const = 0;
  // With more than one, several devices share each scene, whatever its size. At least 1; more than
  // there are left are taken as all of them.
  virtual void useDevices(int count) = 0;
  // A device that fails is not used again; what it leaves undone the others do, among them those
  // that its source has in reserve. Throws DeviceFailure when the last one has failed,
  // DeviceWasReset when one was, and std::bad_alloc.
  int find(const BoxSet& boxes, int threads, PairList& pairs) override = 0;
  // How many have failed.
  virtual int devicesLost() const = 0;
  // Those that have failed since the last call.
  virtual std::vector<FailedDevice> takeFailures() = 0;
  // That found the pairs of the last find().
  virtual int devicesUsed() const = 0;
  // Host memory only; see deviceBytes.
  std::size_t bytes() const override = 0;
  virtual std::size_t deviceBytes() const = 0;
  // Stage times cost a few events a frame, so they have to be asked for.
  virtual void measure(bool on) = 0;
  virtual const CudaStageTimes& times() const = 0;
};

// Where a finder gets its devices from: the i-th, counted from 0, or -1 where there are not so
// many. The same one may come more than once, and stands for several then. All are of one
// generation (compute capability).
using DeviceSource = std::function<int(std::size_t i)>;

// A finder on the first of these devices, as many as it is told to use. Touches neither driver nor
// device, nor asks the source; find() does.
std::unique_ptr<CudaPairFinder> makeCudaSweep(DeviceSource devices);
std::unique_ptr<CudaPairFinder> makeCudaSweep(const std::vector<int>& devices = {0});

}  // namespace ode_parallel_sap
