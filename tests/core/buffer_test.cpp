// Buffers keep what they should over both kinds of their storage: heap and pages.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "space/data/buffer.h"
#include "support/catch.hpp"

using namespace ode_parallel_sap;

namespace {

template <std::size_t words>
struct Element {
  std::uint64_t word[words];
};

template <std::size_t words>
void checkGrowth() {
  using E = Element<words>;
  INFO(sizeof(E) << " bytes an element");
  for (const std::size_t bytes : {std::size_t{1} << 6, std::size_t{1} << 18, std::size_t{1} << 22})
    for (const int off : {-1, 0, 1}) {
      const std::size_t count = bytes / sizeof(E) + 2 + off;
      Buffer<E> buffer;
      buffer.reserve(count);
      REQUIRE(buffer.capacity() >= count);
      REQUIRE(buffer.bytes() >= count * sizeof(E));
      CHECK(reinterpret_cast<std::uintptr_t>(buffer.data()) % 64 == 0);
      buffer.resize(count);
      for (std::size_t i = 0; i < count; ++i) buffer[i].word[words - 1] = i;
      buffer.resize(3 * count);
      buffer[3 * count - 1].word[0] = 7;  // the last of the storage is there
      Buffer<E> other = std::move(buffer);
      other.resize(count);
      other.shrink();
      bool same = true;
      for (std::size_t i = 0; i < count; ++i) same = same && other[i].word[words - 1] == i;
      CHECK(same);
      other.clearTo(1);
      CHECK(other.size() == 0);
      CHECK(other.bytes() <= 4096);
      other.release();
      CHECK(other.bytes() == 0);
    }
}

}  // namespace

TEST_CASE("Buffers grow, move and shrink over all sizes of storage", "[buffer]") {
  checkGrowth<1>();
  checkGrowth<3>();
  checkGrowth<48>();
}

TEST_CASE("A buffer that grows to a size keeps what it has and fills the rest", "[buffer]") {
  Buffer<int> buffer;
  for (const std::size_t size : {3, 40, 40, 7, 100000}) {
    const std::size_t before = buffer.size();
    buffer.growTo(size, static_cast<int>(size));
    REQUIRE(buffer.size() == std::max(before, size));
    for (std::size_t i = before; i < buffer.size(); ++i) REQUIRE(buffer[i] == int(size));
  }
  CHECK(buffer[2] == 3);
  CHECK(buffer[3] == 40);
  CHECK(buffer[39] == 40);
}

TEST_CASE("The bytes of all members are those of each, and of lists those of what is in them",
          "[buffer]") {
  struct Share {
    Buffer<int> own;
    std::size_t bytes() const { return bytesOf(own); }
  };
  const auto filled = [](std::size_t size) {
    Buffer<int> buffer;
    buffer.resize(size);
    return buffer;
  };
  const Buffer<int> a = filled(100), lists[2] = {filled(1000), filled(3000)};
  std::vector<Share> shares(3);
  shares[1].own = filled(20000);
  const std::vector<std::vector<int>> plain = {{1, 2, 3}, std::vector<int>(500)};
  const std::unique_ptr<Share> none, one(new Share{filled(10)});
  CHECK(bytesOf(a) == a.bytes());
  CHECK(bytesOf(lists) == lists[0].bytes() + lists[1].bytes());
  CHECK(bytesOf(shares) == shares.capacity() * sizeof(Share) + shares[1].own.bytes());
  CHECK(bytesOf(plain) ==
        2 * sizeof(plain[0]) + (plain[0].capacity() + plain[1].capacity()) * sizeof(int));
  CHECK(bytesOf(none) == 0);
  CHECK(bytesOf(one) == sizeof(Share) + one->own.bytes());
  CHECK(bytesOf(a, lists, shares, none) == bytesOf(a) + bytesOf(lists) + bytesOf(shares));
}
