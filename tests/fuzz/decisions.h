// Where a drive through the API takes its decisions from: bytes that a fuzzer makes up, or chance.
#pragma once

#include <cstddef>
#include <cstdint>

#include "../support/random.h"

namespace sap_test {

class Decisions {
 public:
  // The bytes in turn; zeros behind their end.
  Decisions(const std::uint8_t* bytes, std::size_t size) : next_(bytes), end_(bytes + size) {}
  // Any, without end.
  explicit Decisions(std::uint64_t seed) : by_chance_(true), random_(seed) {}

  bool more() const { return by_chance_ || next_ != end_; }
  std::uint8_t byte() {
    if (by_chance_) return static_cast<std::uint8_t>(random_.bits() >> 32);
    return next_ == end_ ? 0 : *next_++;
  }
  // In [0, n), n up to 65536.
  std::size_t below(std::size_t n) {
    if (n <= 1) return 0;
    const std::size_t low = byte();
    return (n <= 256 ? low : low << 8 | byte()) % n;
  }
  bool chance(int of_256) { return byte() < of_256; }
  // For work that would take too many bytes to decide in detail.
  Random random() { return Random(below(65536)); }

 private:
  const std::uint8_t *next_ = nullptr, *end_ = nullptr;
  bool by_chance_ = false;
  Random random_{0};
};

}  // namespace sap_test
