// Buffers keep what they should over all steps of their storage: heap, pages, huge pages.
#include <cstdint>
#include <utility>

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
