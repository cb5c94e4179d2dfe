#include "join.h"

#include <algorithm>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace ode_parallel_sap {

using namespace device;

namespace {

// Long enough that handing them out costs nothing, short enough to stay in a core's cache.
constexpr std::size_t slice_pairs = 1 << 15;
// Words looked at together. Behind a share's words there are as many that begin lists.
constexpr std::size_t at_once = 8;
constexpr std::uint32_t first_head = 1u << ahead_shift;  // words from here on begin a list

static_assert(list_block % 32 == 0, "a block has whole words of has_list");

Pair pairOf(Slot earlier, std::uint32_t word) {
  return (std::uint64_t{word} & 1) << 63 | std::uint64_t{earlier} << 32 | (word & word_mask) >> 1;
}

// Words [begin, end) of the lists without the headers between them.
void copyWords(const std::uint32_t* stretches, unsigned long long begin, unsigned long long end,
               std::uint32_t* to) {
  while (begin < end) {
    const unsigned long long stretch = begin / stretch_words, within = begin % stretch_words;
    const std::size_t count =
        static_cast<std::size_t>(std::min<unsigned long long>(end - begin, stretch_words - within));
    std::memcpy(to, stretches + stretch * stretch_size + header_words + within, count * sizeof *to);
    to += count;
    begin += count;
  }
}

#if defined(__SSE2__)
// Writes the pairs of eight words; returns how many of them belong to the first one's list.
inline std::size_t takeEight(const std::uint32_t* words, Slot slot, Pair* to,
                             std::uint32_t& marks) {
  const __m128i earlier = _mm_set1_epi32(static_cast<int>(slot));
  const __m128i limit = _mm_set1_epi32(static_cast<int>(first_head - 1));
  unsigned heads = 0, unsure = 0;
  for (int half = 0; half < 2; ++half) {
    const __m128i word = _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + 4 * half));
    const __m128i low = _mm_srli_epi32(_mm_slli_epi32(word, 32 - ahead_shift), 33 - ahead_shift);
    const __m128i mark = _mm_slli_epi32(word, 31);
    const __m128i high = _mm_or_si128(earlier, mark);
    // Heads are above the limit, or negative.
    const __m128i head = _mm_or_si128(_mm_cmpgt_epi32(word, limit), word);
    heads |= static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(head))) << 4 * half;
    unsure |= static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(mark))) << 4 * half;
    __m128i* const at = reinterpret_cast<__m128i*>(to + 4 * half);
    _mm_storeu_si128(at, _mm_unpacklo_epi32(low, high));
    _mm_storeu_si128(at + 1, _mm_unpackhi_epi32(low, high));
  }
  const unsigned later_heads = heads & ~1u;
  const std::size_t count = later_heads ? static_cast<std::size_t>(__builtin_ctz(later_heads)) : 8;
  marks |= unsure & ((1u << count) - 1);
  return count;
}
#endif

}  // namespace

std::vector<Slice> slicesOf(const ShareLists* shares, int count, std::size_t blocks) {
  std::vector<Slice> slices;
  Slice slice = {};
  std::size_t pairs = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    for (int s = 0; s < count; ++s)
      pairs += static_cast<std::size_t>(shares[s].begins[block + 1] - shares[s].begins[block]);
    if (pairs - slice.pairs < slice_pairs && block + 1 < blocks) continue;
    slice.end = block + 1;
    for (int s = 0; s < count; ++s)
      slice.needed[s] = shares[s].begins[slice.begin] < shares[s].begins[slice.end]
                            ? shares[s].begins[slice.end]
                            : 0;
    if (pairs > slice.pairs) slices.push_back(slice);
    slice.begin = slice.end;
    slice.pairs = pairs;
  }
  const auto last = [count](const Slice& s) {
    return *std::max_element(s.needed, s.needed + count);
  };
  std::sort(slices.begin(), slices.end(), [&](const Slice& a, const Slice& b) {
    return std::make_pair(last(a), a.begin) < std::make_pair(last(b), b.begin);
  });
  return slices;
}

void Joiner::gather(const ShareLists* shares, int count, const Slice& slice) {
  std::size_t size = 0;
  for (int s = 0; s < count; ++s)
    size += static_cast<std::size_t>(shares[s].begins[slice.end] - shares[s].begins[slice.begin]) +
            at_once;
  words_.resizeDiscarding(size);
  std::uint32_t* to = words_.data();
  for (int s = 0; s < count; ++s) {
    const unsigned long long begin = shares[s].begins[slice.begin],
                             end = shares[s].begins[slice.end];
    copyWords(shares[s].stretches, begin, end, to);
    next_[s] = to;
    to += end - begin;
    std::fill(to, to + at_once, first_head);
    to += at_once;
  }
}

// `room`: pairs that may be written, as others write what comes then.
inline Pair* Joiner::takeList(const std::uint32_t*& next, Slot slot, Pair* to, std::size_t room,
                              std::uint32_t& marks) {
  const std::uint32_t* word = next;
#if defined(__SSE2__)
  bool first = true;
  while (room >= at_once && (first || *word < first_head)) {
    first = false;
    const std::size_t count = takeEight(word, slot, to, marks);
    word += count;
    to += count;
    room -= count;
  }
  if (!first && *word >= first_head) {
    next = word;
    return to;
  }
#endif
  do {
    marks |= *word & 1;
    *to++ = pairOf(slot, *word++);
  } while (*word < first_head);
  next = word;
  return to;
}

// The lists of a slot that several shares have: its box reaches over a cut.
Pair* Joiner::mergeLists(const ShareLists* shares, int count, Slot slot, Pair* to,
                         std::uint32_t& marks) {
  merged_.clear();
  for (int s = 0; s < count; ++s) {
    if (!(shares[s].has_list[slot / 32] >> slot % 32 & 1)) continue;
    const std::uint32_t* const begin = next_[s];
    const std::uint32_t* end = begin + 1;
    while (*end < first_head) ++end;
    more_.clear();
    const auto less = [](std::uint32_t a, std::uint32_t b) {
      return (a & word_mask) < (b & word_mask);
    };
    std::merge(merged_.begin(), merged_.end(), begin, end, std::back_inserter(more_), less);
    merged_.swap(more_);
    next_[s] = end;
  }
  for (const std::uint32_t word : merged_) {
    marks |= word & 1;
    *to++ = pairOf(slot, word);
  }
  return to;
}

void Joiner::join(const ShareLists* shares, int count, const Slice& slice, std::size_t slots,
                  bool exact, Pair* const to, std::vector<PairList::Stretch>& unsure) {
  gather(shares, count, slice);
  std::size_t size = 0;
  for (int s = 0; s < count; ++s)
    size += static_cast<std::size_t>(shares[s].begins[slice.end] - shares[s].begins[slice.begin]);
  Pair* at = to + slice.pairs;
  Pair* const end = at + size;
  const std::size_t bit_words = (slots + 31) / 32;
  for (std::size_t block = slice.begin; block < slice.end; ++block) {
    Pair* const block_begin = at;
    std::uint32_t marks = 0;
    const std::size_t last = std::min(bit_words, (block + 1) * (list_block / 32));
    for (std::size_t word = block * (list_block / 32); word < last; ++word) {
      std::uint8_t share_of[32];
      std::uint32_t any = 0, several = 0;
      for (int s = 0; s < count; ++s) {
        const std::uint32_t own = shares[s].has_list[word];
        several |= any & own;
        any |= own;
        for (std::uint32_t left = own; left; left &= left - 1)
          share_of[__builtin_ctz(left)] = static_cast<std::uint8_t>(s);
      }
      for (std::uint32_t left = any; left; left &= left - 1) {
        const int bit = __builtin_ctz(left);
        const Slot slot = static_cast<Slot>(word * 32 + static_cast<std::size_t>(bit));
        at = several >> bit & 1 ? mergeLists(shares, count, slot, at, marks)
                                : takeList(next_[share_of[bit]], slot, at,
                                           static_cast<std::size_t>(end - at), marks);
      }
    }
    if (marks && !exact)
      unsure.push_back(
          {0, static_cast<std::size_t>(block_begin - to), static_cast<std::size_t>(at - to)});
  }
}

}  // namespace ode_parallel_sap
