// Which lists are whose, where several devices share a scene. Host code, too, so no device is
// needed.
#include <algorithm>
#include <vector>

#include "cuda/one/own_slots.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"

using namespace ode_parallel_sap;

TEST_CASE("Each slot is one part's own, and parts differ by the pairs of a block", "[own_slots]") {
  sap_test::Random random(sap_test::seedOr(14));
  for (int round = 0; round < 200; ++round) {
    const std::size_t slots = 2 + random.below(20000);
    const double empty = random.unit();
    std::vector<unsigned long long> ends(slots + 1, 0);
    for (std::size_t i = 0; i < slots; ++i)
      ends[i + 1] = ends[i] + (random.chance(empty) ? 0 : random.below(12));
    unsigned long long most_in_block = 0;
    for (std::size_t i = 0; i < slots; i += device::list_block)
      most_in_block =
          std::max(most_in_block, ends[std::min(i + device::list_block, slots)] - ends[i]);
    for (const std::uint32_t parts : {1, 2, 3, 4, 9, device::most_parts}) {
      INFO(slots << " slots, " << parts << " parts");
      CHECK(device::firstSlotOf(0, parts, ends.data(), slots) == 0);
      std::uint32_t begin = 0;
      for (std::uint32_t part = 0; part < parts; ++part) {
        const std::uint32_t end = device::firstSlotOf(part + 1, parts, ends.data(), slots);
        CHECK(begin <= end);
        CHECK((end % device::list_block == 0 || end == slots));
        CHECK(ends[end] - ends[begin] <= ends[slots] / parts + most_in_block + parts);
        begin = end;
      }
      CHECK(begin == slots);
    }
  }
}
