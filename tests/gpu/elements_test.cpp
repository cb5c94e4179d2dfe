// Where the kernels cut the sorted order, compiled for the host: held against counting by hand.
// What they do with a bound, a box or a pair the pairs of emulated devices show.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "cuda/one/cell_cut.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"

using namespace ode_parallel_sap;
using sap_test::Random;

namespace {

// How many of all keys share the digits from `shift` on with this one.
template <class Key>
std::size_t alike(const std::vector<Key>& keys, Key key, int shift) {
  return static_cast<std::size_t>(std::count_if(
      keys.begin(), keys.end(), [&](Key other) { return other >> shift == key >> shift; }));
}

// Returns whether more boxes have one key than a search can bear.
template <class Key>
bool checkCuts(std::vector<Key> keys) {
  constexpr int class_shift = sizeof(Key) * 8 - device::class_digits;
  std::sort(keys.begin(), keys.end());
  std::size_t begin = 0, equal_from = 0;
  bool clustered = false, cluster = false;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const device::CellCut cut = device::cellCutAt(keys.data(), keys.size(), i);
    clustered = clustered || cut.cluster;
    if (i == 0) {
      REQUIRE(cut.begins);
      continue;
    }
    if (keys[i] != keys[i - 1]) equal_from = i;
    cluster = cluster || i - equal_from == device::cluster_size;
    const Key differ = keys[i] ^ keys[i - 1];
    bool expected;
    if (differ >> class_shift)
      expected = true;
    else if (differ)
      expected = alike(keys, keys[i], device::highestDigit(differ) + 1) > device::cell_size;
    else
      expected =
          alike(keys, keys[i], 0) > device::cell_size && (i - equal_from) % device::cell_size == 0;
    REQUIRE(cut.begins == expected);
    if (cut.begins) {
      REQUIRE(i - begin <= device::cell_size);
      begin = i;
    }
  }
  REQUIRE(keys.size() - begin <= device::cell_size);
  REQUIRE(clustered == cluster);
  return cluster;
}

}  // namespace

TEST_CASE("Cells are whole blocks of space, of 32 boxes at most, or a cluster", "[elements]") {
  Random random(sap_test::seedOr(97));
  for (const std::size_t count : {1024, 1025, 5000})
    CHECK(checkCuts(std::vector<std::uint32_t>(count, 7)) == (count > device::cluster_size));
  for (int round = 0; round < 60; ++round) {
    INFO("round " << round);
    const std::size_t count = 1 + random.below(round % 10 == 0 ? 2500 : 600);
    // Few keys that differ anywhere, or many in one place.
    const int digits = 1 + static_cast<int>(random.below(32));
    const double clustered = random.chance(0.3) ? random.unit() : 0;
    std::vector<std::uint32_t> keys;
    std::vector<std::uint64_t> long_keys;
    const std::uint32_t place = static_cast<std::uint32_t>(random.bits());
    for (std::size_t i = 0; i < count; ++i) {
      const auto any = static_cast<std::uint32_t>(random.bits() >> 32);
      keys.push_back(random.chance(clustered) ? place : any >> (32 - digits) << random.below(2));
      long_keys.push_back(std::uint64_t{keys.back()} << 32 | (random.chance(0.5) ? any & 3 : 0));
    }
    checkCuts(keys);
    checkCuts(long_keys);
  }
}
