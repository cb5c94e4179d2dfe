#include "cuda/several/join.h"

#include <algorithm>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace ode_parallel_sap {

using namespace device;

namespace {

constexpr std::size_t write_step = PairStage::beyond;
constexpr std::uint32_t first_head = 1u << ahead_shift;  // words from here on begin a list

// Words [begin, end) of the lists without the headers between them.
void copyWords(const std::uint32_t* segments, unsigned long long begin, unsigned long long end,
               std::uint32_t* to) {
  while (begin < end) {
    const unsigned long long segment = begin / segment_words, within = begin % segment_words;
    const std::size_t count =
        static_cast<std::size_t>(std::min<unsigned long long>(end - begin, segment_words - within));
    std::memcpy(to, segments + segment * segment_size + header_words + within, count * sizeof *to);
    to += count;
    begin += count;
  }
}

// Bit i: words[i] begins a list, of 64 words.
std::uint64_t headsOf(const std::uint32_t* words) {
  std::uint64_t heads = 0;
#if defined(__SSE2__)
  // Saturated, whatever is from first_head on gets its sign.
  const __m128i to_sign = _mm_set1_epi32(static_cast<int>(0x80000000u - first_head));
  const auto four = [&](int i) {
    return _mm_adds_epu16(_mm_load_si128(reinterpret_cast<const __m128i*>(words + i)), to_sign);
  };
  for (int i = 0; i < 64; i += 16) {
    const __m128i eight = _mm_packs_epi32(four(i), four(i + 4));
    const __m128i others = _mm_packs_epi32(four(i + 8), four(i + 12));
    heads |=
        std::uint64_t{static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(eight, others)))}
        << i;
  }
#else
  for (int i = 0; i < 64; ++i) heads |= std::uint64_t{words[i] >= first_head} << i;
#endif
  return heads;
}

bool anyBorderline(const std::uint32_t* words) {
  std::uint32_t all = 0;
  for (int i = 0; i < 64; ++i) all |= words[i];
  return all & 1;
}

// The pairs of write_step words.
inline void writePairs(Slot earlier, const std::uint32_t* words, Pair* to) {
#if defined(__SSE2__)
  const __m128i slot = _mm_set1_epi32(static_cast<int>(earlier));
  for (std::size_t i = 0; i < write_step; i += 4) {
    const __m128i word = _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + i));
    const __m128i low = _mm_srli_epi32(_mm_slli_epi32(word, 32 - ahead_shift), 33 - ahead_shift);
    const __m128i high = _mm_or_si128(slot, _mm_slli_epi32(word, 31));
    __m128i* const at = reinterpret_cast<__m128i*>(to + i);
    _mm_storeu_si128(at, _mm_unpacklo_epi32(low, high));
    _mm_storeu_si128(at + 1, _mm_unpackhi_epi32(low, high));
  }
#else
  for (std::size_t i = 0; i < write_step; ++i)
    to[i] = (std::uint64_t{words[i]} & 1) << 63 | std::uint64_t{earlier} << 32 |
            (words[i] & word_mask) >> 1;
#endif
}

// Returns the end. Up to a step more is written.
inline Pair* writeList(Slot earlier, const std::uint32_t* words, std::size_t count, Pair* to) {
  for (std::size_t i = 0; i < count; i += write_step) writePairs(earlier, words + i, to + i);
  return to + count;
}

// The first block behind `begin` before which there are `wanted` pairs, or `blocks`. It is looked
// for near `guess`: slices have about the same number of blocks.
template <class PairsBefore>
std::size_t blockWith(std::size_t wanted, std::size_t begin, std::size_t guess, std::size_t blocks,
                      PairsBefore pairsBefore) {
  std::size_t step = 1, low = begin, high = std::min(guess, blocks);
  for (; high < blocks && pairsBefore(high) < wanted; step *= 2) {
    low = high;
    high = std::min(high + step, blocks);
  }
  for (step = 1; low == begin && high > begin + step && pairsBefore(high - step) >= wanted;
       step *= 2)
    high -= step;
  while (high - low > 1) {
    const std::size_t middle = low + (high - low) / 2;
    (pairsBefore(middle) < wanted ? low : high) = middle;
  }
  return high;
}

}  // namespace

std::vector<Slice> slicesOf(const ShareLists* shares, int count, std::size_t blocks) {
  const auto pairsBefore = [&](std::size_t block) {
    unsigned long long pairs = 0;
    for (int s = 0; s < count; ++s) pairs += shares[s].begins[block];
    return static_cast<std::size_t>(pairs);
  };
  std::vector<Slice> slices;
  for (std::size_t begin = 0, length = 1; begin < blocks;) {
    Slice slice = {};
    slice.begin = begin;
    slice.pairs = pairsBefore(begin);
    slice.end = blockWith(slice.pairs + slice_pairs, begin, begin + length, blocks, pairsBefore);
    for (int s = 0; s < count; ++s)
      if (shares[s].begins[slice.begin] < shares[s].begins[slice.end])
        slice.needed[s] = shares[s].begins[slice.end];
    slice.most_needed = *std::max_element(slice.needed, slice.needed + count);
    if (slice.most_needed > 0) slices.push_back(slice);
    length = slice.end - slice.begin;
    begin = slice.end;
  }
  std::sort(slices.begin(), slices.end(), [](const Slice& a, const Slice& b) {
    return std::make_pair(a.most_needed, a.begin) < std::make_pair(b.most_needed, b.begin);
  });
  return slices;
}

void PairStage::begin(Pair* to, bool past_caches) {
  pairs_.resizeDiscarding(capacity + beyond);
  count_ = 0;
  to_ = to;
  past_caches_ = past_caches;
}

Pair* PairStage::room(std::size_t count) {
  if (count_ + count > capacity) pass();
  return pairs_.data() + count_;
}

// Passes on whole lines if they go past the caches, everything otherwise.
void PairStage::pass() {
  const Pair* from = pairs_.data();
  const Pair* const end = from + count_;
#if defined(__SSE2__)
  if (past_caches_) {
    while (from < end && reinterpret_cast<std::uintptr_t>(to_) % (line * sizeof(Pair)) != 0)
      *to_++ = *from++;
    for (; static_cast<std::size_t>(end - from) >= line; from += line, to_ += line)
      for (std::size_t i = 0; i < line; i += 2)
        _mm_stream_si128(reinterpret_cast<__m128i*>(to_ + i),
                         _mm_loadu_si128(reinterpret_cast<const __m128i*>(from + i)));
    count_ = static_cast<std::size_t>(end - from);
    std::copy(from, end, pairs_.data());
    return;
  }
#endif
  to_ = std::copy(from, end, to_);
  count_ = 0;
}

void PairStage::end() {
  pass();
  std::copy_n(pairs_.data(), count_, to_);
#if defined(__SSE2__)
  if (past_caches_) _mm_sfence();
#endif
}

void Joiner::gather(const Joining& joining, const Slice& slice) {
  const ShareLists* const shares = joining.shares;
  const int count = joining.count;
  // Each share's words end with a head at least.
  const auto wordsOf = [&](int s) {
    return static_cast<std::size_t>(shares[s].begins[slice.end] - shares[s].begins[slice.begin]);
  };
  const auto sizeOf = [&](int s) { return (wordsOf(s) / 64 + 1) * 64; };
  std::size_t size = 0, at = 0;
  for (int s = 0; s < count; ++s) size += sizeOf(s);
  words_.resizeDiscarding(size + PairStage::beyond);
  summaries_.resizeDiscarding(size / 64);
  std::fill_n(words_.data() + size, PairStage::beyond, 0);
  for (int s = 0; s < count; ++s) {
    std::uint32_t* const words = words_.data() + at;
    Summary* const summaries = summaries_.data() + at / 64;
    copyWords(shares[s].segments, shares[s].begins[slice.begin], shares[s].begins[slice.end],
              words);
    std::fill(words + wordsOf(s), words + sizeOf(s), first_head);
    for (std::size_t i = 0; i < sizeOf(s); i += 64)
      summaries[i / 64] = {headsOf(words + i), anyBorderline(words + i)};
    cursors_[s] = {words, summaries, summaries[0].heads & ~std::uint64_t{1}, 0, 0};
    at += sizeOf(s);
  }
}

// Finds the lists of a group of slots from `first` on; returns which of them have one, and adds up
// their pairs. Where lists begin comes from bits: to follow the words from list to list would be to
// wait for each of them.
std::uint64_t Joiner::takeLists(const Joining& joining, std::size_t first, std::size_t& pairs) {
  others_.clear();
  const std::size_t word = first / 32;
  const bool two_words = first + 32 < joining.slots;
  std::uint64_t any = 0;
  for (int s = 0; s < joining.count; ++s) {
    const std::uint32_t* const has_list = joining.shares[s].has_list + word;
    const std::uint64_t own = has_list[0] | (two_words ? std::uint64_t{has_list[1]} << 32 : 0);
    const std::uint64_t again = any & own;
    any |= own;
    Cursor cursor = cursors_[s];
    for (std::uint64_t left = own; left; left &= left - 1) {
      const int bit = __builtin_ctzll(left);
      while (cursor.left == 0) cursor.left = cursor.summaries[(cursor.base += 64) / 64].heads;
      const std::size_t end = cursor.base + static_cast<std::size_t>(__builtin_ctzll(cursor.left));
      cursor.left &= cursor.left - 1;
      if (again >> bit & 1) others_.push_back({bit, lists_[bit]});
      lists_[bit] = {cursor.words + cursor.begin, end - cursor.begin};
      cursor.begin = end;
    }
    pairs += cursor.begin - cursors_[s].begin;
    cursors_[s] = cursor;
  }
  return any;
}

// The lists of a slot that several shares have: its box reaches over a cut.
Joiner::List Joiner::merged(int bit) {
  const auto less = [](std::uint32_t a, std::uint32_t b) {
    return (a & word_mask) < (b & word_mask);
  };
  const auto mergeWith = [&](const List& list) {
    const std::size_t size = merged_.size() + list.count;
    more_.resizeDiscarding(size);
    std::merge(merged_.begin(), merged_.end(), list.words, list.words + list.count, more_.begin(),
               less);
    merged_.swap(more_);
  };
  merged_.resizeDiscarding(0);
  mergeWith(lists_[bit]);
  for (const Another& other : others_)
    if (other.bit == bit) mergeWith(other.list);
  const std::size_t count = merged_.size();
  merged_.resize(count + PairStage::beyond);
  std::fill(merged_.begin() + count, merged_.end(), 0);
  return {merged_.data(), count};
}

// False if no pair of the block is borderline.
bool Joiner::hasBorderline(const Joining& joining, const Slice& slice, std::size_t block) const {
  for (int s = 0; s < joining.count; ++s) {
    const unsigned long long* const begins = joining.shares[s].begins;
    const unsigned long long end = begins[block + 1] - begins[slice.begin];
    for (unsigned long long i = (begins[block] - begins[slice.begin]) / 64; i * 64 < end; ++i)
      if (cursors_[s].summaries[i].borderline) return true;
  }
  return false;
}

// The pairs of a group's lists; several thousand are passed on list by list.
void Joiner::put(std::size_t first, std::uint64_t any, std::size_t pairs) {
  const bool few = pairs <= PairStage::most;
  Pair* to = few ? stage_.room(pairs) : nullptr;
  std::uint64_t several = 0;
  for (const Another& other : others_) several |= std::uint64_t{1} << other.bit;
  for (; any; any &= any - 1) {
    const int bit = __builtin_ctzll(any);
    const Slot slot = static_cast<Slot>(first + static_cast<std::size_t>(bit));
    const List list = several >> bit & 1 ? merged(bit) : lists_[bit];
    if (few)
      to = writeList(slot, list.words, list.count, to);
    else
      for (std::size_t i = 0; i < list.count; i += PairStage::most) {
        const std::size_t part = std::min(list.count - i, PairStage::most);
        writeList(slot, list.words + i, part, stage_.room(part));
        stage_.add(part);
      }
  }
  if (few) stage_.add(pairs);
}

void Joiner::join(const Joining& joining, const Slice& slice,
                  std::vector<PairList::Segment>& borderline) {
  static_assert(list_block % group == 0, "a block has whole groups");
  gather(joining, slice);
  stage_.begin(joining.to + slice.pairs, joining.past_caches);
  std::size_t at = slice.pairs;
  for (std::size_t block = slice.begin; block < slice.end; ++block) {
    const std::size_t block_begin = at, last = std::min(joining.slots, (block + 1) * list_block);
    for (std::size_t first = block * list_block; first < last; first += group) {
      std::size_t pairs = 0;
      const std::uint64_t any = takeLists(joining, first, pairs);
      put(first, any, pairs);
      at += pairs;
    }
    if (!joining.exact && hasBorderline(joining, slice, block))
      borderline.push_back({0, block_begin, at});
  }
  stage_.end();
}

}  // namespace ode_parallel_sap
