// What a device sends, made pairs on the CPU: no device is needed for that.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "cuda/one/expand.h"
#include "space/data/buffer.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"

using namespace ode_parallel_sap;
using sap_test::Random;

namespace {

// Lists of pairs, and the words a device would send for them (scene_plan.h).
struct Lists {
  std::vector<Pair> pairs;
  Buffer<std::uint32_t> segments;
  std::vector<std::uint32_t> has_list;

  Lists(std::size_t count, std::size_t longest, std::size_t widest_gap, Random& random) {
    std::vector<std::uint32_t> words;
    std::vector<Slot> earlier;
    Slot slot = static_cast<Slot>(random.below(widest_gap)), before = 0;
    while (words.size() < count) {
      const std::size_t length = 1 + random.below(longest);
      for (std::size_t i = 0; i < length && words.size() < count; ++i) {
        const Slot later = slot + 1 + static_cast<Slot>(random.below(1000));
        const bool borderline = random.chance(0.1);
        std::uint32_t ahead = i > 0 ? 0 : words.empty() ? 0 : slot - before;
        ahead = std::min(ahead, device::far_ahead);
        words.push_back(ahead << device::ahead_shift | later << 1 | std::uint32_t{borderline});
        earlier.push_back(slot);
        pairs.push_back(makePair(slot, later) | (borderline ? borderline_bit : 0));
      }
      has_list.resize(slot / 32 + 1);
      has_list[slot / 32] |= 1u << slot % 32;
      before = slot;
      slot += 1 + static_cast<Slot>(random.below(widest_gap));
    }
    has_list.push_back(0);
    const std::size_t parts = (count + device::segment_words - 1) / device::segment_words;
    segments.resize(parts * device::segment_size);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t part = i / device::segment_words, place = i % device::segment_words;
      std::uint32_t* const segment = segments.data() + part * device::segment_size;
      if (place == 0) segment[0] = earlier[i];
      segment[device::header_words + place] = words[i];
    }
  }
};

}  // namespace

TEST_CASE("Words of a device become the pairs they stand for", "[expand]") {
  const std::uint64_t seed = sap_test::seedOr(71);
  Random random(seed);
  for (const std::size_t count : {1, 2, 3, 4, 7, 8, 9, 31, 1023, 1024, 1025, 5000})
    for (const std::size_t longest : {1, 3, 40, 3000})
      for (const std::size_t widest_gap : {1, 3, 8, 500}) {
        INFO("seed " << seed << ", " << count << " words, lists up to " << longest
                     << ", gaps up to " << widest_gap);
        const Lists lists(count, longest, widest_gap, random);
        constexpr Pair untouched = ~Pair{0};
        Buffer<Pair> pairs;
        pairs.resize(count + 2);
        std::fill(pairs.begin(), pairs.end(), untouched);
        for (std::size_t begin = 0; begin < count; begin += device::segment_words) {
          const std::size_t words = std::min(count - begin, device::segment_words);
          const std::uint32_t* const segment =
              lists.segments.data() + begin / device::segment_words * device::segment_size;
          const bool borderline = std::any_of(
              lists.pairs.begin() + begin, lists.pairs.begin() + begin + words, isMarkedBorderline);
          REQUIRE(expandSegment(segment, words, lists.has_list.data(), pairs.data() + begin) ==
                  borderline);
        }
        REQUIRE(std::equal(lists.pairs.begin(), lists.pairs.end(), pairs.begin()));
        REQUIRE(pairs[count] == untouched);
        REQUIRE(pairs[count + 1] == untouched);
      }
}
