// Uninitialised storage that is reused from frame to frame, and where it comes from.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#include "space/base/tuning.h"

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace ode_parallel_sap {

// Small storage is the heap's. From 256 bytes on it begins with a cache line. Large storage
// (least_mapped) is the system's own pages.
class Storage {
 public:
  static constexpr std::size_t unit = 16, least_aligned = 256;  // fixed: the heap's; a GroupFilter
  // What a wish for so many bytes is rounded up to.
  static std::size_t sizeFor(std::size_t bytes) {
    const std::size_t step = bytes < least_aligned ? unit : bytes < least_mapped ? line : page;
    return (bytes + step - 1) & ~(step - 1);
  }
  // `size` is that of sizeFor(). Throws std::bad_alloc.
  static void* allocate(std::size_t size) {
#if defined(__linux__)
    if (isMapped(size)) {
      void* const mapped =
          mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      if (mapped == MAP_FAILED) throw std::bad_alloc();
      return mapped;
    }
#endif
    return ::operator new(size, alignmentOf(size));
  }
  // `data` may be null.
  static void deallocate(void* data, std::size_t size) {
#if defined(__linux__)
    if (data && isMapped(size)) {
      if (const Watcher watcher = before_unmapping.load(std::memory_order_acquire)) watcher(data);
      munmap(data, size);
      return;
    }
#endif
    ::operator delete(data, alignmentOf(size));
  }

  // Called with each storage of the system's own pages before it goes, as long as it is set: a
  // device may have been given these pages.
  using Watcher = void (*)(void* data);
  inline static std::atomic<Watcher> before_unmapping{nullptr};

  // Whether storage of a size (of sizeFor()) is the system's own pages. Sanitizers watch the heap.
  static bool isMapped(std::size_t size) {
#if !defined(__linux__) || defined(__SANITIZE_ADDRESS__)
    return (void)size, false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
    return (void)size, false;
#endif
#endif
    return size >= least_mapped;
  }

 private:
  static constexpr std::size_t line = 64, page = 4096;  // fixed: the machine's

  static std::align_val_t alignmentOf(std::size_t size) {
    return std::align_val_t{size < least_aligned ? unit : line};
  }
};

// Grows geometrically and never shrinks by itself. New elements are not written, so that the
// operating system places their pages near the thread that writes them first.
template <class T>
class Buffer {
  static_assert(std::is_trivially_copyable<T>::value, "elements are moved by memcpy");
  static_assert(alignof(T) <= Storage::unit || sizeof(T) >= Storage::least_aligned,
                "small storage is not aligned to a line of the cache");

 public:
  Buffer() = default;
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Buffer() { free(); }

  T* data() { return data_; }
  const T* data() const { return data_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  std::size_t size() const { return size_; }
  std::size_t capacity() const { return capacity_; }
  std::size_t bytes() const { return Storage::sizeFor(capacity_ * sizeof(T)); }
  T* begin() { return data_; }
  T* end() { return data_ + size_; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }

  // Sets the size; the contents are kept up to the smaller of both sizes.
  void resize(std::size_t size) {
    if (size > capacity_) reallocate(size > capacity_ + capacity_ / 2 ? size : capacity_ * 3 / 2);
    size_ = size;
  }
  // Makes it no smaller than that; what is new gets this value.
  void growTo(std::size_t size, const T& value) {
    const std::size_t before = size_;
    if (size <= before) return;
    resize(size);
    std::fill(data_ + before, data_ + size, value);
  }
  // Sets the size. Storage that grows loses its contents; as nothing is copied, it grows by little.
  void resizeDiscarding(std::size_t size) {
    if (size > capacity_) {
      size_ = 0;
      reallocate(size > capacity_ + capacity_ / 8 ? size : capacity_ + capacity_ / 8);
    }
    size_ = size;
  }
  void reserve(std::size_t capacity) {
    if (capacity > capacity_) reallocate(capacity);
  }
  void push_back(const T& value) {
    const T copy = value;
    resize(size_ + 1);
    data_[size_ - 1] = copy;
  }
  // Gives back what is beyond the size.
  void shrink() {
    if (size_)
      reallocate(size_);
    else
      release();
  }
  void release() {
    free();
    data_ = nullptr;
    size_ = capacity_ = 0;
  }
  void swap(Buffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

 private:
  void free() { Storage::deallocate(data_, bytes()); }

  void reallocate(std::size_t capacity) {
    const std::size_t size = Storage::sizeFor(capacity * sizeof(T));
    T* data = static_cast<T*>(Storage::allocate(size));
    if (size_) std::memcpy(static_cast<void*>(data), data_, size_ * sizeof(T));
    free();
    data_ = data;
    capacity_ = size / sizeof(T);
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

// A part of something that most do without: made when it is first needed. Null without memory.
template <class T>
T* made(std::unique_ptr<T>& part) {
  if (!part) part.reset(new (std::nothrow) T);
  return part.get();
}
// One that other threads may read while one thread makes it.
template <class T>
class SharedPart {
 public:
  SharedPart() = default;
  ~SharedPart() { delete get(); }
  SharedPart(const SharedPart&) = delete;
  SharedPart& operator=(const SharedPart&) = delete;

  T* get() const { return part_.load(std::memory_order_acquire); }
  T* made() {
    if (!get()) part_.store(new (std::nothrow) T, std::memory_order_release);
    return get();
  }
  std::size_t bytes() const { return get() ? sizeof(T) + get()->bytes() : 0; }

 private:
  std::atomic<T*> part_{nullptr};
};

// The bytes that things hold: what has bytes(), and lists of such things or of plain elements.
template <class T>
std::size_t bytesOf(const T& one) {
  return one.bytes();
}
template <class T>
std::size_t bytesOf(const std::unique_ptr<T>& one) {
  return one ? sizeof(T) + one->bytes() : 0;
}
template <class T, std::size_t count>
std::size_t bytesOf(const T (&list)[count]) {
  std::size_t bytes = 0;
  for (const T& one : list) bytes += bytesOf(one);
  return bytes;
}
template <class T>
std::size_t bytesOf(const std::vector<T>& list) {
  std::size_t bytes = list.capacity() * sizeof(T);
  if constexpr (!std::is_trivially_copyable<T>::value)
    for (const T& one : list) bytes += bytesOf(one);
  return bytes;
}
template <class First, class Second, class... Rest>
std::size_t bytesOf(const First& first, const Second& second, const Rest&... rest) {
  return bytesOf(first) + bytesOf(second, rest...);
}

// Makes as many lists, one for each thread of a team, and all of them empty.
template <class T>
void clearForTeam(std::vector<Buffer<T>>& lists, std::size_t count) {
  if (lists.size() < count) lists.resize(count);
  for (Buffer<T>& list : lists) list.resizeDiscarding(0);
}

// Makes one list of those that threads have made, each in a share of its own.
template <class Share, class T>
void gather(const std::vector<Share>& shares, Buffer<T> Share::*list, Buffer<T>& all) {
  std::size_t count = 0;
  for (const Share& share : shares) count += (share.*list).size();
  all.resizeDiscarding(count);
  T* end = all.data();
  for (const Share& share : shares)
    end = std::copy((share.*list).begin(), (share.*list).end(), end);
}

}  // namespace ode_parallel_sap
