#include "cuda/device/page_locks.h"

#include <cuda.h>
#include <cuda_runtime_api.h>
#include <pthread.h>

#include <map>
#include <mutex>

#include "space/base/buffer.h"

namespace ode_parallel_sap {

namespace {

// All pages that are locked, by where they begin. Never destroyed: storage may outlive it.
class LockedStorage {
 public:
  static LockedStorage& ofProgram() {
    static LockedStorage* const locked = new LockedStorage;
    return *locked;
  }

  bool lock(void* data, std::size_t bytes, const DriverContext& context) {
    const std::lock_guard<std::mutex> guard(mutex_);
    const auto known = entries_.find(data);
    if (known != entries_.end()) {
      const Entry& is = known->second;
      const bool may_be_lost = is.context.device == context.device && is.context.id != context.id;
      if (is.bytes == bytes && is.forks == forks_ && !may_be_lost) return true;
      unlock(known);
    }
    const Entry entry = {bytes, forks_, context};
    const auto place = entries_.emplace(data, entry).first;  // or there would be no memory for it
    if (cudaCallIsToFail() ||
        cudaHostRegister(data, bytes, cudaHostRegisterPortable) != cudaSuccess) {
      cudaGetLastError();  // so that nobody else meets it
      entries_.erase(place);
      return false;
    }
    Storage::before_unmapping.store(forget, std::memory_order_release);
    return true;
  }

 private:
  struct Entry {
    std::size_t bytes;
    unsigned long long forks;
    DriverContext context;
  };
  using Entries = std::map<void*, Entry>;

  LockedStorage() {
    pthread_atfork([] { ofProgram().mutex_.lock(); },
                   [] {
                     ++ofProgram().forks_;
                     ofProgram().mutex_.unlock();
                   },
                   // No device is the child's.
                   [] {
                     ofProgram().entries_.clear();
                     ofProgram().mutex_.unlock();
                   });
  }

  static void forget(void* data) {
    LockedStorage& locked = ofProgram();
    const std::lock_guard<std::mutex> guard(locked.mutex_);
    const auto known = locked.entries_.find(data);
    if (known != locked.entries_.end()) locked.unlock(known);
  }
  // At the end of the program the runtime may be gone already, and its pages with it.
  void unlock(Entries::iterator entry) {
    if (!isLost(entry->second.context)) {
      const ScopedDevice device(entry->second.context, std::nothrow);
      if (cudaHostUnregister(entry->first) != cudaSuccess) cudaGetLastError();
    }
    entries_.erase(entry);
  }

  std::mutex mutex_;
  Entries entries_;
  unsigned long long forks_ = 0;  // of the program so far
};

}  // namespace

void PageLock::lock(const void* data, std::size_t bytes, const DriverContext& context) {
  const bool again = data == last_ && bytes == last_bytes_;
  if (!again) refused_ = false;
  last_ = data;
  last_bytes_ = bytes;
  mapped_ = nullptr;
  if (!again || refused_ || !Storage::isMapped(bytes)) return;
  void* const host = const_cast<void*>(data);
  refused_ = !LockedStorage::ofProgram().lock(host, bytes, context);
  if (!refused_) CHECK_CUDA(cudaHostGetDevicePointer(&mapped_, host, 0));
}

}  // namespace ode_parallel_sap
