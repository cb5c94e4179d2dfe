// Lists from which pairs were dropped are closed up as std::remove would, by any team.
#include <algorithm>
#include <vector>

#include "space/geoms/pair_gaps.h"
#include "support/case.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"
#include "support/teams.h"

using namespace ode_parallel_sap;

namespace {

// Some parts, some of them empty, of ascending pairs; and which pairs of them are dropped.
struct Gapped {
  PairList list;
  std::vector<PairList::Segment> gaps;
  std::vector<std::vector<Pair>> expected;  // by part
};

void fill(Gapped& made, sap_test::Random& random) {
  const double shares[] = {0, 0.001, 0.1, 0.9, 1};
  const double share = shares[random.below(5)];
  const std::size_t parts = 1 + random.below(4);
  made.list.clear(parts);
  made.expected.resize(parts);
  Slot next = 0;
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t count = random.chance(0.2) ? random.below(4) : random.below(3000);
    for (std::size_t i = 0; i < count; ++i, ++next) {
      const bool drop = random.chance(share);
      const Pair pair = makePair(next, next + 7);
      made.list.parts[part].push_back(drop ? dropped_pair : pair);
      if (!drop) made.expected[part].push_back(pair);
    }
    // Stretches that hold what is dropped, and more.
    for (std::size_t at = 0; at < count;) {
      const std::size_t end = std::min(count, at + 1 + random.below(40));
      const Buffer<Pair>& pairs = made.list.parts[part];
      if (std::count(pairs.begin() + at, pairs.begin() + end, dropped_pair) || random.chance(0.1))
        made.gaps.push_back({part, at, end});
      at = end;
    }
  }
  for (std::size_t i = made.gaps.size(); i > 1; --i)
    std::swap(made.gaps[i - 1], made.gaps[random.below(i)]);
}

}  // namespace

TEST_CASE("Gaps are closed in place, and what is left stays in its order", "[pair-gaps]") {
  const std::uint64_t seed = sap_test::seedOr(21);
  sap_test::Random random(seed);
  const sap_test::ScopedGrain grain(1);
  PairGaps gaps;  // with what the lists before left in it
  for (int run = 0; run < sap_test::scaled(600); ++run)
    for (const int threads : {1, 2, 3, 7, 16}) {
      Gapped made;
      fill(made, random);
      gaps.close(made.gaps, threads, made.list);
      INFO("run " << run << ", " << threads << " threads, seed " << seed);
      for (std::size_t part = 0; part < made.expected.size(); ++part) {
        const Buffer<Pair>& got = made.list.parts[part];
        REQUIRE(std::vector<Pair>(got.begin(), got.end()) == made.expected[part]);
      }
    }
}

TEST_CASE("Pieces become one, whatever is left of each", "[pair-gaps]") {
  const std::uint64_t seed = sap_test::seedOr(22);
  sap_test::Random random(seed);
  const sap_test::ScopedGrain grain(1);
  PairGaps gaps;
  for (int run = 0; run < sap_test::scaled(600); ++run)
    for (const int threads : {1, 2, 3, 7}) {
      Buffer<Pair> part;
      std::vector<PairGaps::Piece> pieces;
      std::vector<Pair> expected;
      Slot next = 0;
      const std::size_t before = random.below(20);  // that no piece has
      for (std::size_t i = 0; i < before; ++i, ++next) expected.push_back(makePair(next, next + 1));
      for (const Pair pair : expected) part.push_back(pair);
      for (std::size_t i = random.below(9); i > 0; --i) {
        const std::size_t begin = part.size(), count = random.below(200);
        const std::size_t kept = random.chance(0.3) ? 0 : random.below(count + 1);
        for (std::size_t k = 0; k < count; ++k, ++next) {
          const Pair pair = makePair(next, next + 1);
          part.push_back(k < kept ? pair : dropped_pair);
          if (k < kept) expected.push_back(pair);
        }
        pieces.push_back({begin, begin + count, kept});
      }
      gaps.join(pieces, threads, part);
      INFO("run " << run << ", " << threads << " threads, seed " << seed);
      REQUIRE(std::vector<Pair>(part.begin(), part.end()) == expected);
    }
}

TEST_CASE("A list is read by places, across its parts", "[pair-gaps]") {
  sap_test::Random random(sap_test::seedOr(23));
  for (int run = 0; run < 300; ++run) {
    Gapped made;
    fill(made, random);
    const std::vector<Pair> all = joined(made.list);
    std::vector<Pair> got;
    PairCursor cursor(made.list);
    for (std::size_t at = 0; at < all.size();) {
      const std::size_t skipped = random.chance(0.3) ? random.below(all.size() - at) : 0;
      got.insert(got.end(), all.begin() + at, all.begin() + at + skipped);
      at += skipped;
      const std::size_t end = at + random.below(all.size() - at + 1);
      cursor.read(at, end, [&](const Pair* from, const Pair* to) {
        REQUIRE(from < to);
        got.insert(got.end(), from, to);
      });
      at = end;
    }
    REQUIRE(got == all);
  }
}
