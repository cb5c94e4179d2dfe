// How storage on a device grows, on an allocator that only counts: no device is needed for that.
#include "cuda/device/memory_block.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <new>

#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"

using namespace ode_parallel_sap;

namespace {

struct Counted {
  static inline std::size_t held = 0, most_held = 0, allocations = 0;
  static inline bool fails = false;
  static inline std::map<void*, std::size_t> blocks;  // with their bytes

  static void* allocate(std::size_t bytes) {
    ++allocations;
    if (fails) throw std::bad_alloc();
    void* const memory = std::malloc(bytes);
    blocks[memory] = bytes;
    held += bytes;
    most_held = std::max(most_held, held);
    return memory;
  }
  static void release(void* memory) {
    held -= blocks.at(memory);
    blocks.erase(memory);
    std::free(memory);
  }
};

using Block = MemoryBlock<std::uint64_t, Counted>;

}  // namespace

TEST_CASE(
    "A block of memory grows by half at least, never holds old and new at once, and is empty where "
    "it could not grow",
    "[memory block]") {
  sap_test::Random random(sap_test::seedOr(81));
  Block block;
  CHECK(block.data() == nullptr);
  std::size_t most = 0, failures = 0;
  for (int frame = 0; frame < 2000; ++frame) {
    const std::size_t wanted = frame < 1000 ? frame + 1 : random.below(100000);
    const std::uint64_t* const data = block.data();
    const std::size_t capacity = block.capacity(), before = Counted::allocations;
    Counted::fails = random.chance(0.5);
    if (Counted::fails && wanted > capacity) {
      REQUIRE_THROWS_AS(block.reserve(wanted), std::bad_alloc);
      REQUIRE(block.data() == nullptr);
      REQUIRE(block.capacity() == 0);
      REQUIRE(Counted::held == 0);
      Counted::most_held = 0;
      ++failures;
      continue;
    }
    block.reserve(wanted);
    REQUIRE((Counted::allocations != before) == (wanted > capacity));
    if (wanted <= capacity) REQUIRE(block.data() == data);
    if (wanted > capacity) REQUIRE(block.capacity() == std::max(wanted, capacity + capacity / 2));
    if (wanted > 0) block[wanted - 1] = wanted;
    most = std::max(most, wanted);
    REQUIRE(block.bytes() == block.capacity() * sizeof(std::uint64_t));
    REQUIRE(Counted::held == block.bytes());
    REQUIRE(Counted::most_held == block.bytes());
  }
  CHECK(failures > 0);
  CHECK(block.capacity() <= most + most / 2);
  block.release();
  CHECK(Counted::held == 0);
  CHECK(block.capacity() == 0);
  block.release();  // no more than nothing
}
