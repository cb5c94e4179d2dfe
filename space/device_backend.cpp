#include "device_backend.h"

#include <ode/ode.h>

#if ODE_PARALLEL_SAP_HAS_CUDA
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "../cuda/cuda_axis_lists.h"
#include "../cuda/cuda_sweep.h"
#endif

namespace ode_parallel_sap {

DeviceBackend::DeviceBackend() = default;
DeviceBackend::~DeviceBackend() = default;

#if ODE_PARALLEL_SAP_HAS_CUDA

namespace {

// The devices of this machine, for all spaces of the program.
class DevicePool {
 public:
  static DevicePool& get() {
    static DevicePool pool;
    return pool;
  }

  // Asks the driver when called for the first time.
  const std::vector<int>& devices() {
    std::call_once(asked_, [this] {
      devices_ = listed();
      count_ = static_cast<int>(devices_.size());
    });
    return devices_;
  }
  // As far as is known without asking: there may be one.
  int count() const { return count_; }
  // Devices whose context exists.
  int ready() const { return ready_; }

  // Has the first `wanted` devices made ready by another thread, which returns at once.
  void prepare(int wanted) {
    if (wanted <= ready_ || busy_.exchange(true)) return;
    if (thread_.joinable()) thread_.join();
    thread_ = std::thread([this, wanted] {
      prepareNow(wanted);
      busy_ = false;
    });
  }

 private:
  DevicePool() = default;
  ~DevicePool() {
    if (thread_.joinable()) thread_.join();
  }

  // ODE_PARALLEL_SAP_VIRTUAL_DEVICES=n takes that many of those that there are, or lets them stand
  // for that many: for tests.
  static std::vector<int> listed() {
    const std::vector<int> real = cudaDevices();
    const char* const text = std::getenv("ODE_PARALLEL_SAP_VIRTUAL_DEVICES");
    const std::size_t wanted = text ? std::strtoul(text, nullptr, 10) : 0;
    if (wanted == 0 || real.empty()) return real;
    std::vector<int> devices;
    while (devices.size() < wanted) devices.push_back(real[devices.size() % real.size()]);
    return devices;
  }

  // Finds a few pairs on each, so that the driver has loaded what it takes. A device that fails
  // here and those behind it are left alone.
  void prepareNow(int wanted) {
    BoxSet boxes;
    boxes.size = 4096;
    boxes.boxes.resize(boxes.size);
    for (std::size_t i = 0; i < boxes.size; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        boxes.boxes[i].lower[axis] = static_cast<float>((i >> 4 * axis) % 16);
        boxes.boxes[i].upper[axis] = boxes.boxes[i].lower[axis] + 1.5f;
      }
    PairList pairs;
    try {
      while (ready_ < wanted && ready_ < static_cast<int>(devices().size())) {
        makeCudaSweep({devices()[static_cast<std::size_t>(ready_)]})->find(boxes, 1, pairs);
        ++ready_;
      }
    } catch (const std::exception&) {
      count_ = ready_.load();
    }
  }

  std::once_flag asked_;
  std::vector<int> devices_;
  std::atomic<int> count_{1}, ready_{0};
  std::atomic<bool> busy_{false};
  std::thread thread_;
};

BackendChoice::Candidates candidatesFor(const DeviceBackend::Wish& wish, int devices) {
  if (wish.devices == 0) return BackendChoice::Candidates::upTo(wish.processor, devices);
  return BackendChoice::Candidates::only(wish.processor, std::min(wish.devices, devices));
}

}  // namespace

struct DeviceBackend::Finder {
  std::unique_ptr<CudaPairFinder> sweep = makeCudaSweep(DevicePool::get().devices());
  std::unique_ptr<CudaAxisListsFinder> axis_lists;
};

bool deviceAvailable() {
  return !DevicePool::get().devices().empty();
}

int DeviceBackend::choose(const BoxSet& boxes, const Wish& wish) {
  if (failed_ || boxes.wide) return 0;
  const DevicePool& pool = DevicePool::get();
  // A number that is set without leave for the processor is taken as it is.
  if (!wish.processor && wish.devices > 0) return wish.devices;
  int ready = pool.ready();
  if (finder_) ready = std::min(ready, finder_->sweep->devicesLeft());
  if (!wish.processor) ready = std::max(ready, 1);
  if (ready < std::min(wish.devices, pool.count())) ready = 0;
  return choice_.choose(boxes.size, candidatesFor(wish, ready));
}

void DeviceBackend::reportFailure(const char* reason, int devices_left) {
  choice_.lost(devices_left);
  if (devices_left > 0)
    dMessage(0, "parallel SAP space: a GPU failed (%s), %d of them go on", reason, devices_left);
  else
    dMessage(0, "parallel SAP space: the GPU failed (%s), pairs are found on the CPU from now on",
             reason);
}

// Does the work unless all devices failed before. Where the last one fails now, that was the last
// time.
template <class Work>
int DeviceBackend::attempt(PairList& pairs, Work work) {
  if (failed_) return 0;
  try {
    if (!finder_) finder_ = std::make_unique<Finder>();
    return work();
  } catch (const DeviceFailure& failure) {
    reportFailure(failure.what(), 0);
    failed_ = true;
    finder_.reset();
    pairs.clear(1);
    return 0;
  }
}

int DeviceBackend::find(const BoxSet& boxes, int threads, int devices, PairList& pairs) {
  return attempt(pairs, [&] {
    CudaPairFinder& sweep = *finder_->sweep;
    if (!sweep.takes(boxes)) return 0;
    sweep.useDevices(devices);
    sweep.find(boxes, threads, pairs);
    for (const std::string& reason : sweep.failures())
      reportFailure(reason.c_str(), sweep.devicesLeft());
    return sweep.devicesUsed();
  });
}

int DeviceBackend::findByAxisLists(const BoxSet& boxes, int threads, int devices,
                                   std::uint64_t most_bytes, PairList& pairs) {
  return attempt(pairs, [&] {
    if (!finder_->axis_lists) finder_->axis_lists = makeCudaAxisLists();
    CudaAxisListsFinder& lists = *finder_->axis_lists;
    std::vector<int> used = DevicePool::get().devices();
    used.resize(std::min<std::size_t>(used.size(), static_cast<std::size_t>(devices)));
    lists.useDevices(used);
    lists.limit(most_bytes);
    lists.find(boxes, threads, pairs);
    return static_cast<int>(used.size());
  });
}

void DeviceBackend::learn(const Wish& wish, int devices, std::size_t boxes, std::size_t pairs,
                          double ms) {
  if (failed_ || (!wish.processor && wish.devices > 0)) return;
  devices = std::min(devices, BackendChoice::most_devices);
  choice_.learn(devices, boxes, pairs, ms);
  DevicePool& pool = DevicePool::get();
  const int wanted = choice_.wanted(boxes, candidatesFor(wish, pool.count()), pool.ready());
  if (wanted > 0) pool.prepare(std::min(wanted, pool.count()));
}

std::size_t DeviceBackend::bytes() const {
  if (!finder_) return 0;
  return finder_->sweep->bytes() + (finder_->axis_lists ? finder_->axis_lists->bytes() : 0);
}

#else

struct DeviceBackend::Finder {};

bool deviceAvailable() {
  return false;
}
int DeviceBackend::choose(const BoxSet&, const Wish&) {
  return 0;
}
int DeviceBackend::find(const BoxSet&, int, int, PairList&) {
  return 0;
}
int DeviceBackend::findByAxisLists(const BoxSet&, int, int, std::uint64_t, PairList&) {
  return 0;
}
void DeviceBackend::learn(const Wish&, int, std::size_t, std::size_t, double) {}
std::size_t DeviceBackend::bytes() const {
  return 0;
}

#endif

}  // namespace ode_parallel_sap
