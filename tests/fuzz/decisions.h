// Where a drive through the API takes its decisions from: bytes that a fuzzer makes up, or chance.
#pragma once

#include <cstddef>
#include <cstdint>

#include "../support/random.h"

namespace sap_test {

class Decisions {
 public:
  virtual ~Decisions() = default;
  virtual bool more() const = 0;
  virtual std::uint8_t byte() = 0;

  // In [0, n), n up to 65536.
  std::size_t below(std::size_t n) {
    if (n <= 1) return 0;
    const std::size_t low = byte();
    return (n <= 256 ? low : low << 8 | byte()) % n;
  }
  bool chance(int of_256) { return byte() < of_256; }
  // For work that would take too many bytes to decide in detail.
  Random random() { return Random(below(65536)); }
};

// The bytes in turn; zeros behind their end.
class ByteDecisions : public Decisions {
 public:
  ByteDecisions(const std::uint8_t* bytes, std::size_t size) : next_(bytes), end_(bytes + size) {}
  bool more() const override { return next_ != end_; }
  std::uint8_t byte() override { return next_ == end_ ? 0 : *next_++; }

 private:
  const std::uint8_t* next_;
  const std::uint8_t* const end_;
};

class RandomDecisions : public Decisions {
 public:
  explicit RandomDecisions(std::uint64_t seed) : random_(seed) {}
  bool more() const override { return true; }
  std::uint8_t byte() override { return static_cast<std::uint8_t>(random_.bits() >> 32); }

 private:
  Random random_;
};

}  // namespace sap_test
