#include "expand.h"

#include <algorithm>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace ode_parallel_sap {

namespace {

// Words are expanded this many at a time where there is room for as many.
constexpr std::size_t group = 8;

inline Pair pairOf(std::uint64_t earlier, std::uint32_t word) {
  return (std::uint64_t{word} & 1) << 63 | earlier << 32 | word >> 1;
}

inline void expandOneByOne(std::uint64_t earlier, const std::uint32_t* words, std::size_t count,
                           Pair* pairs) {
  for (std::size_t i = 0; i < count; ++i) pairs[i] = pairOf(earlier, words[i]);
}

// `group` words, whatever slot they are of.
inline void expandGroup(std::uint32_t earlier, const std::uint32_t* words, Pair* pairs) {
#if defined(__SSE2__)
  const __m128i slot = _mm_set1_epi32(static_cast<int>(earlier));
  for (std::size_t i = 0; i < group; i += 4) {
    const __m128i word = _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + i));
    const __m128i low = _mm_srli_epi32(word, 1);
    const __m128i high = _mm_or_si128(slot, _mm_slli_epi32(word, 31));
    __m128i* const to = reinterpret_cast<__m128i*>(pairs + i);
    _mm_storeu_si128(to, _mm_unpacklo_epi32(low, high));
    _mm_storeu_si128(to + 1, _mm_unpackhi_epi32(low, high));
  }
#else
  expandOneByOne(earlier, words, group, pairs);
#endif
}

template <class Count>
bool expand(const ListIndex& index, const Count* counts, const std::uint32_t* words,
            std::size_t begin, std::size_t end, Pair* pairs) {
  const std::size_t blocks = (index.slots + index.block - 1) / index.block;
  // The block of the first word: the last one that begins at or before it.
  std::size_t block = std::upper_bound(index.block_begins, index.block_begins + blocks + 1, begin) -
                      index.block_begins - 1;
  std::size_t slot = block * index.block;
  std::size_t left_out = begin - index.block_begins[block];  // words of the block before `begin`
  while (left_out >= counts[slot]) left_out -= counts[slot++];
  std::size_t count = std::min(counts[slot] - left_out, end - begin);

  const std::size_t total = end - begin;
  std::uint32_t all = 0;
  for (std::size_t at = 0;;) {
    // Groups may reach into the next list, whose pairs are written over in their turn.
    std::size_t done = 0;
    for (; done < count && at + done + group <= total; done += group)
      expandGroup(static_cast<std::uint32_t>(slot), words + at + done, pairs + at + done);
    if (done < count) expandOneByOne(slot, words + at + done, count - done, pairs + at + done);
    at += count;
    if (at == total) break;
    ++slot;
    // Nothing in a whole block.
    if (slot % index.block == 0)
      while (index.block_begins[slot / index.block + 1] == begin + at) slot += index.block;
    count = std::min<std::size_t>(counts[slot], total - at);
  }
  for (std::size_t i = 0; i < total; ++i) all |= words[i];
  return all & 1;
}

}  // namespace

bool expandPairs(const ListIndex& index, const std::uint32_t* words, std::size_t begin,
                 std::size_t end, Pair* pairs) {
  if (begin == end) return false;
  return index.counts ? expand(index, index.counts, words, begin, end, pairs)
                      : expand(index, index.short_counts, words, begin, end, pairs);
}

}  // namespace ode_parallel_sap
