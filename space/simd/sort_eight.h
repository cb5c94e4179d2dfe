// Short lists of pairs in order without a branch, for sets of lanes with AVX2. Internal linkage, as
// in kernels_impl.h.
#pragma once

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

namespace {

struct EightSorter {
  static constexpr bool sorts_eight = true;

  // Sorts the first `count` of eight words by their low 31 bits, no two of which are alike or all
  // ones, from `words` to `sorted`. The others may end up anywhere behind them in `sorted`.
  static void sortEight(const std::uint64_t* words, std::size_t count, std::uint64_t* sorted) {
    const auto load = [](const std::uint64_t* p) {
      return _mm256_castsi256_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)));
    };
    const __m256i largest = _mm256_set1_epi32(0x7fffffff);
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256i used = _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), lane);
    const __m256i low_halves = _mm256_permute4x64_epi64(
        _mm256_castps_si256(_mm256_shuffle_ps(load(words), load(words + 4), 0x88)), 0xd8);
    const __m256i keys = _mm256_blendv_epi8(largest, _mm256_and_si256(low_halves, largest), used);
    // A word's place is the number of keys below its own.
    __m256i places = _mm256_setzero_si256();
    for (int turn = 1; turn < 8; ++turn) {
      const __m256i others = _mm256_permutevar8x32_epi32(
          keys,
          _mm256_and_si256(_mm256_add_epi32(lane, _mm256_set1_epi32(turn)), _mm256_set1_epi32(7)));
      places = _mm256_sub_epi32(places, _mm256_cmpgt_epi32(keys, others));
    }
    alignas(32) std::uint32_t place[8];
    _mm256_store_si256(reinterpret_cast<__m256i*>(place), _mm256_blendv_epi8(lane, places, used));
    for (int i = 0; i < 8; ++i) sorted[place[i]] = words[i];
  }
};

}  // namespace
