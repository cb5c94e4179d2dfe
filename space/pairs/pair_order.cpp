#include "space/pairs/pair_order.h"

#include <algorithm>
#include <utility>

#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/pairs/radix_sort.h"

namespace ode_parallel_sap {

namespace {

constexpr std::size_t most_buckets = std::size_t{1} << most_digits;

// fixed: pairs of a line of the cache.
constexpr std::size_t line_pairs = 64 / sizeof(Pair);
constexpr std::size_t few_pairs = 64;  // fixed: counters cost more than comparing them in any case
constexpr int short_pair_bits = 31;    // fixed: of a word, but for the borderline mark

Region counting("pair order: counts"), dealing("pair order: deal"), sorting("pair order: buckets");

// Returns whether one of the pairs is borderline.
bool sortFew(Pair* pairs, std::size_t count) {
  std::sort(pairs, pairs + count,
            [](Pair a, Pair b) { return (a & ~borderline_bit) < (b & ~borderline_bit); });
  return std::any_of(pairs, pairs + count, isMarkedBorderline);
}

}  // namespace

// A pair of a bucket in 32 bits: as it is, but for the earlier slot, which is counted from the
// bucket's first.
class PairOrder::ShortPair {
 public:
  ShortPair(const Buckets& buckets, std::size_t bucket)
      : first_slot_(buckets.firstSlot(bucket)), slot_bits_(buckets.slot_bits), bits_(slot_bits_) {
    while ((buckets.slotsOf(bucket) - 1) >> (bits_ - slot_bits_)) ++bits_;
  }
  int bits() const { return bits_; }  // but for the top one, which marks what is borderline
  bool fits() const { return bits_ <= short_pair_bits; }
  std::uint32_t of(Pair pair) const {
    return static_cast<std::uint32_t>(pair >> 63 << 31) |
           (earlierOf(pair) - first_slot_) << slot_bits_ | laterOf(pair);
  }
  Pair pairOf(std::uint32_t word) const {
    const std::uint32_t slots = word & 0x7fffffff, later = slots & ((1u << slot_bits_) - 1);
    return makePair(first_slot_ + (slots >> slot_bits_), later) | Pair{word >> 31} << 63;
  }

 private:
  Slot first_slot_;
  int slot_bits_, bits_;
};

// As words half as long, in `passes` passes over them.
template <int passes, int digit_bits>
bool PairOrder::sortWords(const Pair* found, std::size_t count, const ShortPair& shape, Pair* pairs,
                          Scratch& scratch) {
  constexpr std::uint32_t digits = 1u << digit_bits;
  const auto digitOf = [](std::uint32_t word, int pass) {
    return (word & 0x7fffffff) >> pass * digit_bits & (digits - 1);
  };
  scratch.counts.assign(passes * digits, 0);
  std::uint32_t* const next = scratch.counts.data();
  scratch.words.resizeDiscarding(2 * count);
  std::uint32_t *from = scratch.words.data(), *to = from + count, all = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t word = shape.of(found[i]);
    from[i] = word;
    all |= word;
    for (int pass = 0; pass < passes; ++pass) ++next[pass * digits + digitOf(word, pass)];
  }
  for (int pass = 0; pass < passes; ++pass) {
    std::uint32_t* const at = next + pass * digits;
    for (std::uint32_t digit = 0, position = 0; digit < digits; ++digit)
      position += std::exchange(at[digit], position);
    if (pass + 1 < passes)
      for (std::size_t i = 0; i < count; ++i) to[at[digitOf(from[i], pass)]++] = from[i];
    else
      for (std::size_t i = 0; i < count; ++i)
        pairs[at[digitOf(from[i], pass)]++] = shape.pairOf(from[i]);
    std::swap(from, to);
  }
  return all >> 31;
}

// Pairs that no word has room for: by digits, of the earlier slots by those that differ.
bool PairOrder::sortWide(Pair* pairs, std::size_t count, int slot_bits, Scratch& scratch) {
  Pair all = 0, differing = 0;
  for (std::size_t i = 0; i < count; ++i) {
    all |= pairs[i];
    differing |= pairs[i] ^ pairs[0];
  }
  int earlier_bits = 0;
  while (earlierOf(differing) >> earlier_bits) ++earlier_bits;
  scratch.pairs.resizeDiscarding(count);
  radixSort(pairs, scratch.pairs.data(), count, 0, slot_bits, 1);
  if (earlier_bits) radixSort(pairs, scratch.pairs.data(), count, 32, earlier_bits, 1);
  return isMarkedBorderline(all);
}

// From `found` to `pairs`, which may be the same. In as few passes as the number of pairs is worth
// the counters of.
bool PairOrder::sortBucket(const Pair* found, std::size_t count, const Buckets& buckets,
                           std::size_t bucket, Pair* pairs, Scratch& scratch) {
  const ShortPair shape(buckets, bucket);
  if (count > few_pairs && shape.fits()) {
    const bool few_bits = shape.bits() <= 24;  // three digits of 8 bits, or two of 12
    if (count >> most_digits == 0)
      return few_bits ? sortWords<3, 8>(found, count, shape, pairs, scratch)
                      : sortWords<4, 8>(found, count, shape, pairs, scratch);
    return few_bits ? sortWords<2, 12>(found, count, shape, pairs, scratch)
                    : sortWords<3, 11>(found, count, shape, pairs, scratch);
  }
  if (found != pairs) std::copy(found, found + count, pairs);
  if (count <= few_pairs) return sortFew(pairs, count);
  return sortWide(pairs, count, buckets.slot_bits, scratch);
}

// Small enough for the cache, and enough of them for all threads.
PairOrder::Buckets PairOrder::bucketsFor(std::size_t count, std::size_t slots, int threads) {
  Buckets buckets;
  buckets.slots = slots;
  while ((slots - 1) >> buckets.slot_bits) ++buckets.slot_bits;
  if (threads == 1 && slots <= pairs_at_once / 4 && count <= pairs_at_once) {
    buckets.shift = buckets.slot_bits;
    return buckets;
  }
  const std::size_t shared =
      std::min(tasks_a_thread * threads, count / chunkOf(count, least_bucket_pairs, threads));
  std::size_t wanted = std::max(count / bucket_pairs, shared) + 1;
  // So many that a pair has room in 32 bits, where this leaves enough of them in a bucket.
  const std::size_t short_pairs = std::size_t{1}
                                  << std::max(2 * buckets.slot_bits - short_pair_bits, 0);
  if (short_pairs <= std::min(count / least_bucket_pairs, most_buckets))
    wanted = std::max(wanted, short_pairs);
  wanted = std::min(wanted, most_buckets);
  while ((slots - 1) >> buckets.shift >= wanted) ++buckets.shift;
  buckets.count = ((slots - 1) >> buckets.shift) + 1;
  return buckets;
}

// Deals all pairs into their buckets, one after the other in `dealt`; bucket_begin_ has the places.
void PairOrder::deal(const std::vector<Buffer<Pair>>& found, const Buckets& buckets, int threads,
                     Pair* dealt) {
  const std::size_t parts = found.size();
  const auto bucketOf = [&](Pair pair) { return std::size_t{earlierOf(pair)} >> buckets.shift; };
  positions_.assign(buckets.count * parts, 0);
  runTeam(counting, threads, [&](int thread, int team) {
    for (std::size_t part = thread; part < parts; part += team) {
      if (found[part].size()) noteWork();
      std::size_t* const counts = positions_.data() + buckets.count * part;
      for (const Pair pair : found[part]) ++counts[bucketOf(pair)];
    }
  });
  bucket_begin_.resize(buckets.count + 1);
  std::size_t position = 0;
  for (std::size_t bucket = 0; bucket < buckets.count; ++bucket) {
    bucket_begin_[bucket] = position;
    for (std::size_t part = 0; part < parts; ++part)
      position += std::exchange(positions_[buckets.count * part + bucket], position);
  }
  bucket_begin_[buckets.count] = position;
  runTeam(dealing, threads, [&](int thread, int team) {
    for (std::size_t part = thread; part < parts; part += team) {
      if (found[part].size()) noteWork();
      std::size_t* const next = positions_.data() + buckets.count * part;
      for (const Pair pair : found[part]) {
        Pair* const to = dealt + next[bucketOf(pair)]++;
        *to = pair;
        // More buckets are open than a processor follows by itself.
        prefetchForWriting(to + line_pairs);
      }
    }
  });
}

void PairOrder::sort(const std::vector<Buffer<Pair>>& found, std::size_t slots, int threads,
                     PairList& pairs) {
  std::size_t count = 0;
  for (const Buffer<Pair>& part : found) count += part.size();
  pairs.clear(1);
  pairs.parts[0].resizeDiscarding(count);
  if (count == 0) return;
  Pair* const sorted = pairs.parts[0].data();
  if (scratch_.size() < static_cast<std::size_t>(threads)) scratch_.resize(threads);
  const Buckets buckets = bucketsFor(count, slots, threads);
  if (buckets.count == 1 && found[0].size() == count) {
    if (sortBucket(found[0].data(), count, buckets, 0, sorted, scratch_[0]))
      noteBorderline(sorted, {0, 0, count}, pairs.borderline);
    return;
  }

  deal(found, buckets, threads, sorted);
  for (Scratch& scratch : scratch_) scratch.borderline.clear();
  runChunks(sorting, threads, buckets.count, 1, [&](const Range& range, int thread) {
    const std::size_t begin = bucket_begin_[range.begin], end = bucket_begin_[range.begin + 1];
    if (sortBucket(sorted + begin, end - begin, buckets, range.begin, sorted + begin,
                   scratch_[thread]))
      noteBorderline(sorted, {0, begin, end}, scratch_[thread].borderline);
  });
  for (const Scratch& scratch : scratch_)
    pairs.borderline.insert(pairs.borderline.end(), scratch.borderline.begin(),
                            scratch.borderline.end());
}

}  // namespace ode_parallel_sap
