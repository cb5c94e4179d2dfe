#include "space/pairs/pair_sort.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region counting("pair sort: counts"), dealing("pair sort: buckets"), sorting("pair sort: pairs");

constexpr std::size_t few_pairs = 256;  // are sorted by comparisons

// So many counters are cleared for a few hundred records, and for thousands.
constexpr int few_digits = 8, most_digits = 11;

// One stable counting pass.
void countingPass(const std::uint64_t* from, std::uint64_t* to, std::size_t count, int low_bit,
                  int bits) {
  std::size_t places[std::size_t{1} << most_digits], place = 0;
  const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
  std::fill_n(places, mask + 1, 0);
  for (std::size_t i = 0; i < count; ++i) ++places[from[i] >> low_bit & mask];
  for (std::uint64_t digit = 0; digit <= mask; ++digit)
    place += std::exchange(places[digit], place);
  for (std::size_t i = 0; i < count; ++i) to[places[from[i] >> low_bit & mask]++] = from[i];
}

// Sorts records[0..count) by bits [low_bit, low_bit + bits), stably.
void radixSort(std::uint64_t* records, std::uint64_t* scratch, std::size_t count, int low_bit,
               int bits) {
  const int most = count < std::size_t{1} << most_digits ? few_digits : most_digits;
  const int passes = (bits + most - 1) / most;
  std::uint64_t *from = records, *to = scratch;
  for (int pass = 0, done = 0; pass < passes; ++pass) {
    const int digit_bits = (bits - done + passes - pass - 1) / (passes - pass);
    countingPass(from, to, count, low_bit + done, digit_bits);
    std::swap(from, to);
    done += digit_bits;
  }
  if (from != records) std::copy(from, from + count, records);
}

// Sorts pairs whose earlier slots are the same but for some bits.
void sortBucket(Pair* pairs, Pair* scratch, std::size_t count, int slot_bits, int earlier_bits) {
  if (count <= few_pairs)
    return std::sort(pairs, pairs + count, [](Pair a, Pair b) { return a << 1 < b << 1; });
  radixSort(pairs, scratch, count, 0, slot_bits);
  radixSort(pairs, scratch, count, 32, earlier_bits);
}

// Deals the pairs into buckets by the highest digits of the earlier slot, some for each thread,
// which then sort them.
void sortInBuckets(const std::vector<Buffer<Pair>>& found, int slot_bits, int team, Pair* scratch,
                   Pair* pairs) {
  int bits = 0;
  while (bits < slot_bits && std::size_t{1} << bits < tasks_a_thread * team) ++bits;
  const std::size_t buckets = std::size_t{1} << bits;
  const int low_bit = 32 + slot_bits - bits;
  const auto bucketOf = [=](Pair pair) { return pair >> low_bit & (buckets - 1); };
  std::vector<std::size_t> places(buckets * found.size());  // by bucket, of each part
  runChunks(counting, team, found.size(), 1, [&](const Range& part, int) {
    std::size_t* const counts = places.data() + buckets * part.begin;
    for (const Pair pair : found[part.begin]) ++counts[bucketOf(pair)];
  });
  std::size_t place = 0;
  for (std::size_t bucket = 0; bucket < buckets; ++bucket)
    for (std::size_t part = 0; part < found.size(); ++part)
      place += std::exchange(places[buckets * part + bucket], place);
  runChunks(dealing, team, found.size(), 1, [&](const Range& part, int) {
    std::size_t* const next = places.data() + buckets * part.begin;
    for (const Pair pair : found[part.begin]) pairs[next[bucketOf(pair)]++] = pair;
  });
  // Each bucket ends where its pairs of the last part do.
  const std::size_t* const ends = places.data() + places.size() - buckets;
  runChunks(sorting, team, buckets, 1, [&](const Range& bucket, int) {
    const std::size_t begin = bucket.begin ? ends[bucket.begin - 1] : 0;
    sortBucket(pairs + begin, scratch + begin, ends[bucket.begin] - begin, slot_bits,
               slot_bits - bits);
  });
}

}  // namespace

void sortPairs(const std::vector<Buffer<Pair>>& found, std::size_t slots, int threads,
               Buffer<Pair>& scratch, PairList& pairs) {
  std::size_t count = 0;
  for (const Buffer<Pair>& part : found) count += part.size();
  pairs.clear(1);
  pairs.parts[0].resizeDiscarding(count);
  scratch.resizeDiscarding(count);
  Pair* const all = pairs.parts[0].data();
  int slot_bits = 1;
  while ((slots - 1) >> slot_bits) ++slot_bits;
  if (const int team = teamFor(count, grains::moved_pairs, threads); team > 1) {
    sortInBuckets(found, slot_bits, team, scratch.data(), all);
  } else {
    Pair* end = all;
    for (const Buffer<Pair>& part : found) end = std::copy(part.begin(), part.end(), end);
    sortBucket(all, scratch.data(), count, slot_bits, slot_bits);
  }
  pairs.addParts(/*decided=*/false);
}

}  // namespace ode_parallel_sap
