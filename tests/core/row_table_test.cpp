// Pairs found in any order, put in that of the report: dense and sparse, in short lists and long.
#include <algorithm>
#include <set>
#include <vector>

#include "space/pairs/row_table.h"
#include "support/case.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"

using namespace ode_parallel_sap;

namespace {

// Different pairs of slots below `slots`, of which every tenth is borderline, dealt to some
// buffers. The earlier slots are `spread` apart.
std::vector<Buffer<Pair>> somePairs(std::size_t count, std::size_t slots, std::size_t spread,
                                    sap_test::Random& random) {
  std::set<Pair> pairs;
  while (pairs.size() < count) {
    const Slot earlier = static_cast<Slot>(random.below((slots - 1) / spread + 1) * spread);
    if (earlier + 1 >= slots) continue;
    const Slot later = static_cast<Slot>(earlier + 1 + random.below(slots - earlier - 1));
    pairs.insert(makePair(earlier, later));
  }
  std::vector<Pair> shuffled(pairs.begin(), pairs.end());
  sap_test::shuffle(shuffled.data(), shuffled.size(), random);
  std::vector<Buffer<Pair>> found(random.chance(0.5) ? 1 : 1 + random.below(4));
  for (const Pair pair : shuffled)
    found[random.below(found.size())].push_back(random.chance(0.1) ? pair | borderline_bit : pair);
  return found;
}

void checkSorted(const std::vector<Buffer<Pair>>& found, std::size_t slots, int threads,
                 RowTable& rows) {
  std::vector<Pair> wanted;
  for (const Buffer<Pair>& part : found) wanted.insert(wanted.end(), part.begin(), part.end());
  std::sort(wanted.begin(), wanted.end(),
            [](Pair a, Pair b) { return (a & ~borderline_bit) < (b & ~borderline_bit); });
  PairList pairs;
  rows.start(slots, std::max(threads, static_cast<int>(found.size())));
  for (std::size_t part = 0; part < found.size(); ++part)
    for (const Pair pair : found[part]) rows.add(static_cast<int>(part), pair);
  rows.writePairs(/*exact=*/false, std::max(threads, static_cast<int>(found.size())), nullptr,
                  pairs);
  std::vector<Pair> got;
  for (const PairList::Run& run : pairs.runs) got.insert(got.end(), run.begin(), run.end());
  REQUIRE(got == wanted);
  checkDecidedRuns(pairs);
}

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
  RowTable rows;
  for (const Shape& shape : shapes)
    for (const int threads : {1, 3}) {
      INFO(shape.count << " pairs of " << shape.slots << " slots, every " << shape.spread << ", "
                       << threads << " threads");
      checkSorted(somePairs(shape.count, shape.slots, shape.spread, random), shape.slots, threads,
                  rows);
    }
}
