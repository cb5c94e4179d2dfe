#include "cuda/finder/device_pool.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>

#include "cuda/device/device.h"
#include "cuda/finder/cuda_sweep.h"
#include "space/base/platform.h"

namespace ode_parallel_sap {

namespace {

// ODE_PARALLEL_SAP_VIRTUAL_DEVICES=n takes that many of those that there are, or lets them stand
// for that many: for tests.
std::vector<int> listedDevices() {
  const std::vector<int> real = cudaDevices();
  const char* const text = std::getenv("ODE_PARALLEL_SAP_VIRTUAL_DEVICES");
  const std::size_t wanted = text ? std::strtoul(text, nullptr, 10) : 0;
  if (wanted == 0 || real.empty()) return real;
  std::vector<int> devices;
  while (devices.size() < wanted) devices.push_back(real[devices.size() % real.size()]);
  return devices;
}

// Some boxes with a few pairs.
BoxSet smallScene() {
  BoxSet boxes;
  boxes.size = 4096;
  boxes.boxes.resize(boxes.size);
  for (std::size_t i = 0; i < boxes.size; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      boxes.boxes[i].lower[axis] = static_cast<float>((i >> 4 * axis) % 16);
      boxes.boxes[i].upper[axis] = boxes.boxes[i].lower[axis] + 1.5f;
    }
  return boxes;
}

// Its compute capability.
std::pair<int, int> generationOf(int device) {
  return {attributeOf(device, cudaDevAttrComputeCapabilityMajor),
          attributeOf(device, cudaDevAttrComputeCapabilityMinor)};
}

}  // namespace

DevicePool& DevicePool::get() {
  static DevicePool pool;
  return pool;
}

DevicePool::DevicePool() {
  onFork(nullptr, nullptr, [] { lost_ = used_.load(); });
}

DevicePool::~DevicePool() {
  if (isLost())
    new (&thread_) std::thread;  // the parent's
  else if (thread_.joinable())
    thread_.join();
}

int DevicePool::count() {
  if (isLost()) return 0;
  used_ = true;
  std::call_once(asked_, [this] {
    listed_ = listedDevices();
    usable_.reserve(listed_.size());
    count_ = static_cast<int>(listed_.size());
  });
  return countSoFar();
}

int DevicePool::device(std::size_t i) {
  if (isLost()) return -1;
  const auto isReady = [&] { return i < static_cast<std::size_t>(ready_); };
  if (!isReady()) {
    count();
    const std::lock_guard<std::mutex> lock(making_ready_);
    for (; !isReady() && static_cast<std::size_t>(ready_) < usable_.size(); ++ready_) try {
        findSmallScene(usable_[ready_]);
      } catch (const DeviceFailure&) {
        // The frame that uses it meets the same.
      }
    for (; !isReady() && tried_ < listed_.size(); ++tried_) makeReady(listed_[tried_]);
    if (!isReady() && retry_.isDue()) tryFullOnes();
  }
  return isReady() ? usable_[i] : -1;
}

// So that the driver has loaded what it takes.
void DevicePool::findSmallScene(int device) {
  PairList pairs;
  CudaSweep({device}).find(smallScene(), 1, pairs);
}

void DevicePool::wereReset() {
  const std::lock_guard<std::mutex> lock(making_ready_);
  ready_ = 0;
}

void DevicePool::makeReady(int device) {
  // Stands for several.
  if (std::find(full_.begin(), full_.end(), device) != full_.end()) return addFull(device);
  if (std::find(left_out_.begin(), left_out_.end(), device) != left_out_.end()) {
    --count_;
    return;
  }
  try {
    if (!usable_.empty() && generationOf(device) != generationOf(usable_[0]))
      throw DeviceFailure("another generation than GPU " + std::to_string(usable_[0]));
    findSmallScene(device);
    usable_.push_back(device);
    ++ready_;
  } catch (const DeviceFailure& failure) {
    leaveOut(device, failure);
  }
}

void DevicePool::tryFullOnes() {
  const std::vector<int> again = std::exchange(full_, {});
  retry_.paid();
  full_count_ = 0;
  count_ += static_cast<int>(again.size());
  for (const int device : again) makeReady(device);
}

void DevicePool::addFull(int device) {
  full_.push_back(device);
  ++full_count_;
  --count_;
}

void DevicePool::leaveOut(int device, const DeviceFailure& failure) {
  if (failure.out_of_memory) {
    addFull(device);
    retry_.failed();
    if (std::find(named_.begin(), named_.end(), device) != named_.end()) return;
    named_.push_back(device);
  } else {
    left_out_.push_back(device);
    --count_;
  }
  const std::lock_guard<std::mutex> lock(telling_);
  failures_.push_back({device, failure.what(), failure.out_of_memory});
  has_failures_ = true;
}

std::vector<FailedDevice> DevicePool::takeFailures() {
  if (!has_failures_) return {};
  const std::lock_guard<std::mutex> lock(telling_);
  has_failures_ = false;
  return std::exchange(failures_, {});
}

void DevicePool::prepare(int wanted) {
  if (isLost() || wanted <= ready_ || busy_.exchange(true)) return;
  used_ = true;
  if (thread_.joinable()) thread_.join();
  try {
    thread_ = std::thread([this, wanted] {
      try {
        device(static_cast<std::size_t>(wanted) - 1);
      } catch (const std::exception&) {
        // No memory on the host: asked for again with the next frame.
      }
      busy_ = false;
    });
  } catch (const std::exception&) {
    busy_ = false;  // no thread: likewise
  }
}

}  // namespace ode_parallel_sap
