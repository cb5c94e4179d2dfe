// What several devices share: the cuts through a scene, and the way from their lists to its pairs.
// All of it is host code, so no device is needed.
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "cuda/one/expand.h"
#include "cuda/several/join.h"
#include "cuda/several/partition.h"
#include "space/data/round_outward.h"
#include "space/extract/sweep.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"
#include "support/scenes.h"

using namespace ode_parallel_sap;

namespace {

BoxSet boxSet(const std::vector<sap_test::Box>& scene) {
  BoxSet boxes;
  boxes.size = scene.size();
  boxes.boxes.resize(scene.size());
  for (std::size_t i = 0; i < scene.size(); ++i) {
    const double bounds[6] = {scene[i].low[0],  scene[i].high[0], scene[i].low[1],
                              scene[i].high[1], scene[i].low[2],  scene[i].high[2]};
    roundOutward<double>(bounds, boxes.boxes[i]);
  }
  return boxes;
}

std::vector<Pair> pairsOf(const BoxSet& boxes) {
  Sweep<float> sweep;
  PairList list;
  sweep.find(boxes, 1, list);
  std::vector<Pair> pairs;
  for (const Buffer<Pair>& part : list.parts) pairs.insert(pairs.end(), part.begin(), part.end());
  return pairs;
}

// The share that finds a pair; -1 unless it is exactly one.
int finderOf(Pair pair, const BoxSet& boxes, const Cuts& cuts) {
  const Slot a = earlierOf(pair), b = laterOf(pair);
  const Span of_a = spanOf(boxes.boxes[a], a, cuts), of_b = spanOf(boxes.boxes[b], b, cuts);
  int finder = -1, finders = 0;
  for (int s = std::max(of_a.first, of_b.first); s <= std::min(of_a.last, of_b.last); ++s) {
    if (s > of_a.first && s > of_b.first) continue;  // both are guests
    finder = s;
    ++finders;
  }
  return finders == 1 ? finder : -1;
}

// Whether rows are dealt as spanOf says, each share's boxes ascending.
bool dealtBySpans(const BoxSet& boxes, const Cuts& cuts) {
  DealtRow dealt;
  bool good = true;
  for (std::size_t row = 0; row * DealtRow::slots < boxes.size; ++row) {
    dealt.sort(boxes, row, cuts);
    std::vector<std::vector<std::uint16_t>> expected(static_cast<std::size_t>(cuts.shares));
    for (std::size_t i = 0; i < DealtRow::slots && row * DealtRow::slots + i < boxes.size; ++i) {
      const auto slot = static_cast<Slot>(row * DealtRow::slots + i);
      if (!isActive(boxes.boxes[slot])) continue;
      const Span span = spanOf(boxes.boxes[slot], slot, cuts);
      for (int s = span.first; s <= span.last; ++s)
        expected[static_cast<std::size_t>(s)].push_back(static_cast<std::uint16_t>(i));
    }
    for (std::size_t s = 0; s < expected.size(); ++s) {
      std::uint32_t members[DealtRow::slots / 32] = {};
      for (const std::uint16_t place : expected[s]) members[place / 32] |= 1u << place % 32;
      good = good && dealt.count[s] == expected[s].size() &&
             std::equal(expected[s].begin(), expected[s].end(), dealt.at[s]) &&
             std::equal(std::begin(members), std::end(members), dealt.members[s]);
    }
  }
  return good;
}

// The work of each share; no pair may be found by none or by two.
std::vector<Partition::Work> workOf(const BoxSet& boxes, const std::vector<Pair>& pairs,
                                    const Cuts& cuts) {
  std::vector<Partition::Work> work(static_cast<std::size_t>(cuts.shares));
  for (Slot slot = 0; slot < boxes.size; ++slot) {
    if (!isActive(boxes.boxes[slot])) continue;
    const Span span = spanOf(boxes.boxes[slot], slot, cuts);
    for (int s = span.first; s <= span.last; ++s) ++work[static_cast<std::size_t>(s)].boxes;
  }
  CHECK(dealtBySpans(boxes, cuts));
  std::size_t lost = 0;
  for (const Pair pair : pairs) {
    const int finder = finderOf(pair, boxes, cuts);
    if (finder < 0)
      ++lost;
    else
      ++work[static_cast<std::size_t>(finder)].pairs;
  }
  CHECK(lost == 0);
  return work;
}

// The largest share's work by the mean.
double imbalance(const std::vector<Partition::Work>& work) {
  double most = 0, sum = 0;
  for (const Partition::Work& w : work) {
    most = std::max(most, w.cost());
    sum += w.cost();
  }
  return most * static_cast<double>(work.size()) / sum;
}

std::vector<Partition::Work> sharesAfter(int frames, const BoxSet& boxes,
                                         const std::vector<Pair>& pairs, int shares) {
  Partition partition;
  std::vector<Partition::Work> work;
  for (int frame = 0; frame < frames; ++frame) {
    work = workOf(boxes, pairs, partition.plan(boxes, shares));
    partition.learn(work.data());
  }
  return work;
}

}  // namespace

TEST_CASE("Every pair belongs to one share, and all have the same work", "[shares]") {
  for (const sap_test::BoxScene& scene : sap_test::boxScenes()) {
    const bool quadratic = std::string(scene.name) == "one place";
    const BoxSet boxes = boxSet(scene.make(quadratic ? 1200 : 20000, 7));
    const std::vector<Pair> pairs = pairsOf(boxes);
    for (const int shares : {1, 2, 3, 4, 8}) {
      INFO(scene.name << ", " << shares << " shares");
      const std::vector<Partition::Work> work = sharesAfter(8, boxes, pairs, shares);
      std::string all;
      for (const Partition::Work& w : work)
        all += " " + std::to_string(w.boxes) + "/" + std::to_string(w.pairs);
      INFO("boxes/pairs:" << all);
      CHECK(imbalance(work) <= 1.1);
    }
  }
}

TEST_CASE("Cuts follow a scene that moves", "[shares]") {
  std::vector<sap_test::Box> scene = sap_test::denseCube(20000, 3);
  Partition partition;
  double worst = 0;
  for (int frame = 0; frame < 30; ++frame) {
    // The scene moves on, and half of it gathers in one corner.
    for (std::size_t i = 0; i < scene.size(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const double shrink = i % 2 ? -0.02 * scene[i].low[axis] : 0.4;
        scene[i].low[axis] += shrink;
        scene[i].high[axis] += shrink;
      }
    const BoxSet boxes = boxSet(scene);
    const std::vector<Partition::Work> work =
        workOf(boxes, pairsOf(boxes), partition.plan(boxes, 4));
    if (frame >= 5) worst = std::max(worst, imbalance(work));
    partition.learn(work.data());
  }
  CHECK(worst <= 1.1);
}

TEST_CASE("Strange bounds go where their pairs are", "[shares]") {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::nanf("");
  sap_test::Random random(sap_test::seedOr(11));
  const float bounds[] = {-inf, -3.4e38f, -2, -1, -1e-45f, -0.0f, 0.0f, 1e-45f, 1, 2, 3.4e38f, inf};
  const auto any = [&] { return bounds[random.below(sizeof bounds / sizeof *bounds)]; };
  for (int round = 0; round < 40; ++round) {
    BoxSet boxes;
    boxes.size = 150;
    boxes.boxes.resize(boxes.size);
    for (Box& box : boxes.boxes) {
      for (int axis = 0; axis < 3; ++axis) {
        box.lower[axis] = any();
        box.upper[axis] = any();
      }
      if (random.chance(0.05))
        for (int axis = 0; axis < 3; ++axis) box.lower[axis] = box.upper[axis] = nan;
    }
    std::vector<Pair> pairs;
    for (Slot a = 0; a < boxes.size; ++a)
      for (Slot b = a + 1; b < boxes.size; ++b) {
        bool overlap = true;
        for (int axis = 0; axis < 3; ++axis)
          overlap = overlap && boxes.boxes[a].lower[axis] <= boxes.boxes[b].upper[axis] &&
                    boxes.boxes[b].lower[axis] <= boxes.boxes[a].upper[axis];
        if (overlap) pairs.push_back(makePair(a, b));
      }
    Partition partition;
    for (const int shares : {2, 5, most_shares})
      workOf(boxes, pairs, partition.plan(boxes, shares));
  }
}

namespace {

// Lists as a device would send them.
struct Sent {
  std::vector<std::uint32_t> segments, has_list;
  std::vector<unsigned long long> begins;
  ShareLists lists() const { return {segments.data(), begins.data(), has_list.data()}; }
};

Sent sent(const std::vector<Pair>& pairs, std::size_t slots) {
  using namespace device;
  Sent made;
  const std::size_t blocks = (slots + list_block - 1) / list_block;
  made.has_list.assign((slots + 31) / 32, 0);
  made.begins.assign(blocks + 1, pairs.size());
  made.segments.assign((pairs.size() + segment_words - 1) / segment_words * segment_size, 0);
  std::size_t block = 0;
  Slot before = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Slot earlier = earlierOf(pairs[i]);
    for (; block <= earlier / list_block; ++block) made.begins[block] = i;
    made.has_list[earlier / 32] |= 1u << earlier % 32;
    const bool head = i == 0 || earlier != before;
    // Within a block a list tells its distance; otherwise it is far.
    const bool near =
        i > 0 && earlier / list_block == before / list_block && earlier - before < far_ahead;
    const std::uint32_t ahead = !head ? 0 : near ? earlier - before : far_ahead;
    before = earlier;
    std::uint32_t* const segment = made.segments.data() + i / segment_words * segment_size;
    if (i % segment_words == 0) segment[0] = earlier;
    segment[header_words + i % segment_words] =
        ahead << ahead_shift | laterOf(pairs[i]) << 1 | (isMarkedBorderline(pairs[i]) ? 1 : 0);
  }
  return made;
}

bool inOrder(Pair a, Pair b) {
  return (a & ~borderline_bit) < (b & ~borderline_bit);
}

// Ascending pairs with lists of all lengths: none, a few, now and then a very long one.
std::vector<Pair> randomPairs(std::size_t slots, double lists, sap_test::Random& random) {
  std::set<Pair> pairs;
  for (Slot earlier = 0; earlier + 1 < slots; ++earlier) {
    if (!random.chance(lists)) continue;
    const std::size_t length = 1 + (random.chance(0.01) ? random.below(3000) : random.below(11));
    for (std::size_t i = 0; i < length; ++i)
      pairs.insert(
          makePair(earlier, static_cast<Slot>(earlier + 1 + random.below(slots - earlier - 1))));
  }
  std::vector<Pair> all(pairs.begin(), pairs.end());
  for (Pair& pair : all)
    if (random.chance(0.001)) pair |= borderline_bit;
  return all;
}

}  // namespace

TEST_CASE("Lists of several shares become the pairs in order", "[shares]") {
  sap_test::Random random(sap_test::seedOr(12));
  for (const std::size_t slots : {2, 31, 33, 300, 5000, 20011})
    for (const int shares : {1, 2, 3, 4, 9, most_shares})
      for (const double both : {0.0, 0.01, 1.0}) {
        const std::vector<Pair> all = randomPairs(slots, random.unit(), random);
        // Slots in a row are of one share mostly, or of any.
        const bool rows = random.chance(0.5), past_caches = random.chance(0.5);
        std::vector<std::vector<Pair>> of(static_cast<std::size_t>(shares));
        const std::size_t count = of.size();
        for (const Pair pair : all) {
          const std::size_t own = rows ? earlierOf(pair) * count / slots : earlierOf(pair) % count;
          of[random.chance(both) ? random.below(count) : own].push_back(pair);
        }
        std::vector<Sent> made;
        std::vector<ShareLists> lists;
        for (const std::vector<Pair>& pairs : of) made.push_back(sent(pairs, slots));
        for (const Sent& one : made) lists.push_back(one.lists());

        INFO(slots << " slots, " << shares << " shares, " << all.size() << " pairs");
        // A guard behind the pairs: nothing is written past them.
        std::vector<Pair> joined(all.size() + 16, 42);
        std::vector<PairList::Segment> borderline;
        Joiner joiner;
        std::size_t covered = 0;
        std::vector<unsigned long long> words(count, 0);
        std::vector<Slice> slices = slicesOf(lists.data(), shares, (slots + 255) / 256);
        // Each order of slices will do; neighbours are not written over.
        if (random.chance(0.5)) std::reverse(slices.begin(), slices.end());
        for (const Slice& slice : slices)
          joiner.join({lists.data(), shares, slots, false, past_caches, joined.data()}, slice,
                      borderline);
        CHECK(std::all_of(joined.end() - 16, joined.end(), [](Pair p) { return p == 42; }));
        joined.resize(all.size());
        CHECK(joined == all);
        CHECK(std::is_sorted(joined.begin(), joined.end(), inOrder));
        for (const PairList::Segment& segment : borderline)
          for (std::size_t i = segment.begin; i < segment.end; ++i)
            covered += isMarkedBorderline(all[i]);
        CHECK(covered ==
              static_cast<std::size_t>(std::count_if(all.begin(), all.end(), isMarkedBorderline)));
      }
}

TEST_CASE("Slices have the pairs wanted, and no block more", "[shares]") {
  constexpr std::size_t wanted = 1 << 15;
  sap_test::Random random(sap_test::seedOr(14));
  for (int round = 0; round < 200; ++round) {
    const std::size_t blocks = 1 + random.below(300);
    // Any number in a block, or a divisor of what is wanted.
    const std::size_t most = random.chance(0.5) ? 3000 : 100000, even = wanted >> random.below(6);
    const double empty = random.unit();
    const bool all_even = random.chance(0.3);
    std::vector<std::vector<unsigned long long>> begins(1 + random.below(4));
    std::vector<ShareLists> shares;
    for (auto& own : begins) {
      own.push_back(0);
      for (std::size_t block = 0; block < blocks; ++block)
        own.push_back(own.back() + (random.chance(empty) ? 0
                                    : all_even           ? even
                                                         : random.below(most)));
      shares.push_back({nullptr, own.data(), nullptr});
    }
    const auto before = [&](std::size_t block) {
      unsigned long long pairs = 0;
      for (const auto& own : begins) pairs += own[block];
      return pairs;
    };
    std::vector<Slice> slices = slicesOf(shares.data(), static_cast<int>(shares.size()), blocks);
    const auto sooner = [](const Slice& a, const Slice& b) {
      return a.most_needed < b.most_needed;
    };
    CHECK(std::is_sorted(slices.begin(), slices.end(), sooner));
    std::sort(slices.begin(), slices.end(),
              [](const Slice& a, const Slice& b) { return a.begin < b.begin; });
    unsigned long long sum = 0;
    bool good = true;
    for (std::size_t i = 0; i < slices.size(); ++i) {
      const Slice& slice = slices[i];
      const unsigned long long pairs = before(slice.end) - before(slice.begin);
      good = good && slice.pairs == sum && slice.pairs == before(slice.begin);
      good = good && (pairs >= wanted || i + 1 == slices.size()) && pairs > 0;
      good = good &&
             (slice.end == slice.begin + 1 || before(slice.end - 1) - before(slice.begin) < wanted);
      for (std::size_t s = 0; s < shares.size(); ++s)
        good =
            good && slice.needed[s] ==
                        (begins[s][slice.begin] < begins[s][slice.end] ? begins[s][slice.end] : 0);
      sum += pairs;
    }
    CHECK(good);
    CHECK(sum == before(blocks));
  }
}

TEST_CASE("A segment of words becomes its pairs", "[shares]") {
  sap_test::Random random(sap_test::seedOr(13));
  for (int round = 0; round < 60; ++round) {
    const std::vector<Pair> all = randomPairs(2 + random.below(4000), random.unit(), random);
    const Sent made = sent(all, 4100);
    std::vector<Pair> pairs(device::segment_words + 2);
    Pair* const to = pairs.data() + (reinterpret_cast<std::uintptr_t>(pairs.data()) % 16 ? 1 : 0);
    for (std::size_t begin = 0; begin < all.size(); begin += device::segment_words) {
      const std::size_t count = std::min(device::segment_words, all.size() - begin);
      const std::uint32_t* const segment =
          made.segments.data() + begin / device::segment_words * device::segment_size;
      const bool borderline = expandSegment(segment, count, made.has_list.data(), to);
      CHECK(std::equal(to, to + count, all.begin() + static_cast<std::ptrdiff_t>(begin)));
      CHECK(borderline == std::any_of(to, to + count, isMarkedBorderline));
    }
  }
}
