// Pairs found in any order, put in that of the report: dense and sparse, in short lists and long.
#include <set>

#include "space/pairs/row_table.h"
#include "support/case.h"

using namespace ode_parallel_sap;

namespace {

// Different pairs of slots, of which every tenth is borderline; the earlier slots are so far apart.
struct Shape {
  std::size_t count, slots, spread;
};

// None, one, few to a chunk of slots and many, and slots of few and many bits.
constexpr Shape shapes[] = {{0, 10, 1},
                            {1, 2, 1},
                            {1, 100000, 1},
                            {7, 9, 1},
                            {256, 100000, 1},
                            {257, 100000, 1},
                            {20000, 250, 1},
                            {20000, 600, 1},
                            {20000, 4096, 1},
                            {20000, 4097, 1},
                            {90000, 2200, 1},
                            {20000, 50000, 2500},
                            {20000, 5000000, 1},
                            {20000, 3000000, 500000},
                            {140000, 1 << 27, 1 << 27}};

}  // namespace

TEST_CASE("Pairs come ascending, however many there are to a slot", "[row-table]") {
  const std::uint64_t seed = sap_test::seedOr(1);
  INFO("seed " << seed);
  sap_test::Random random(seed);
  const auto isBefore = [](Pair a, Pair b) {
    return (a & ~borderline_bit) < (b & ~borderline_bit);
  };
  RowTable rows;
  PairList list;
  for (const Shape& shape : shapes)
    for (const int threads : {1, 3}) {
      INFO(shape.count << " pairs of " << shape.slots << " slots, every " << shape.spread << ", "
                       << threads << " threads");
      std::set<Pair, decltype(isBefore)> pairs(isBefore);
      while (pairs.size() < shape.count) {
        const std::size_t earlier =
            random.below((shape.slots - 1) / shape.spread + 1) * shape.spread;
        if (earlier + 1 >= shape.slots) continue;
        const std::size_t later = earlier + 1 + random.below(shape.slots - earlier - 1);
        pairs.insert(makePair(static_cast<Slot>(earlier), static_cast<Slot>(later)) |
                     (random.chance(0.1) ? borderline_bit : 0));
      }
      const std::vector<Pair> wanted(pairs.begin(), pairs.end());
      std::vector<Pair> dealt = wanted;
      sap_test::shuffle(dealt.data(), dealt.size(), random);
      const int parts = random.chance(0.5) ? 1 : 1 + static_cast<int>(random.below(4));
      const int team = std::max(threads, parts);
      rows.start(shape.slots, team);
      for (const Pair pair : dealt)
        rows.add(static_cast<int>(random.below(static_cast<std::size_t>(parts))), pair);
      rows.writePairs(/*exact=*/false, team, nullptr, list);
      REQUIRE(joined(list) == wanted);
      checkDecidedRuns(list);
    }
}
