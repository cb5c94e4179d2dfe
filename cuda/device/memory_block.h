// Storage of a kind that is dear to allocate. Plain host code.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// Uninitialised storage that grows geometrically and is reused from frame to frame. The contents
// are lost when it grows, and the old storage is given back before the new is asked for, so that a
// device need never hold both. `Memory` allocates, and throws where it cannot; the block is empty
// then.
template <class T, class Memory>
class MemoryBlock {
 public:
  MemoryBlock() = default;
  ~MemoryBlock() { release(); }
  MemoryBlock(const MemoryBlock&) = delete;
  MemoryBlock& operator=(const MemoryBlock&) = delete;

  T* data() { return data_; }
  const T* data() const { return data_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  std::size_t capacity() const { return capacity_; }
  std::size_t bytes() const { return capacity_ * sizeof(T); }

  // Room for at least `count` elements.
  void reserve(std::size_t count) {
    if (count <= capacity_) return;
    const std::size_t grown = capacity_ + capacity_ / 2;
    const std::size_t capacity = count > grown ? count : grown;
    release();
    data_ = static_cast<T*>(Memory::allocate(capacity * sizeof(T)));
    capacity_ = capacity;
  }
  void release() {
    if (data_) Memory::release(data_);
    data_ = nullptr;
    capacity_ = 0;
  }

 private:
  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

}  // namespace ode_parallel_sap
