// Lets ODE get the memory next that it gave back last, if the size is the same.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <cstdlib>
#include <utility>

namespace sap_test {

// For one thread.
class SameAddresses {
 public:
  SameAddresses() {
    dSetAllocHandler([](std::size_t bytes) {
      return free_ && bytes == bytes_ ? std::exchange(free_, nullptr) : std::malloc(bytes);
    });
    dSetFreeHandler([](void* memory, std::size_t bytes) {
      std::free(std::exchange(free_, memory));
      bytes_ = bytes;
    });
  }
  ~SameAddresses() {
    dSetAllocHandler(nullptr);
    dSetFreeHandler(nullptr);
    std::free(std::exchange(free_, nullptr));
  }
  SameAddresses(const SameAddresses&) = delete;
  SameAddresses& operator=(const SameAddresses&) = delete;

 private:
  inline static thread_local void* free_ = nullptr;
  inline static thread_local std::size_t bytes_ = 0;
};

}  // namespace sap_test
