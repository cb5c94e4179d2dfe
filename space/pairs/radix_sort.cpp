#include "space/pairs/radix_sort.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region counting("radix sort: counts"), scattering("radix sort: scatter"),
    copying("radix sort: copy");

// One stable counting pass. Each thread counts and later scatters one part of the input; the
// counters become positions by a scan over digits first, threads second.
void countingPass(const std::uint64_t* from, std::uint64_t* to, std::size_t count, int low_bit,
                  int bits, int threads, std::vector<std::uint32_t>& positions) {
  const std::size_t digits = std::size_t{1} << bits;
  const std::uint64_t mask = digits - 1;
  positions.assign(digits * threads, 0);
  runTeam(counting, threads, [&](int thread, int team) {
    const Range range = ownPart(count, thread, team);
    std::uint32_t* const counts = positions.data() + digits * thread;
    for (std::size_t i = range.begin; i < range.end; ++i) ++counts[from[i] >> low_bit & mask];
  });
  std::uint32_t position = 0;
  for (std::size_t digit = 0; digit < digits; ++digit)
    for (int part = 0; part < threads; ++part)
      position += std::exchange(positions[digits * part + digit], position);
  runTeam(scattering, threads, [&](int thread, int team) {
    const Range range = ownPart(count, thread, team);
    std::uint32_t* const next = positions.data() + digits * thread;
    for (std::size_t i = range.begin; i < range.end; ++i)
      to[next[from[i] >> low_bit & mask]++] = from[i];
  });
}

}  // namespace

void radixSort(std::uint64_t* records, std::uint64_t* scratch, std::size_t count, int low_bit,
               int bits, int threads) {
  if (count < 2 || bits <= 0) return;
  threads = teamFor(count, grains::sorted_records, threads);
  const int most = threads == 1 ? most_digits_alone : most_digits;
  const int passes = (bits + most - 1) / most;
  std::vector<std::uint32_t> positions;
  std::uint64_t *from = records, *to = scratch;
  for (int pass = 0, done = 0; pass < passes; ++pass) {
    const int digit_bits = (bits - done + passes - pass - 1) / (passes - pass);
    countingPass(from, to, count, low_bit + done, digit_bits, threads, positions);
    std::swap(from, to);
    done += digit_bits;
  }
  if (from != records)
    runTeam(copying, threads, [&](int thread, int team) {
      const Range range = ownPart(count, thread, team);
      std::memcpy(records + range.begin, from + range.begin,
                  (range.end - range.begin) * sizeof *records);
    });
}

void sortPairs(const std::vector<Buffer<Pair>>& found, std::size_t slots, int threads,
               Buffer<Pair>& scratch, PairList& pairs) {
  constexpr std::size_t few_pairs = 256;
  std::size_t count = 0;
  for (const Buffer<Pair>& part : found) count += part.size();
  pairs.clear(1);
  pairs.parts[0].resizeDiscarding(count);
  Pair* const all = pairs.parts[0].data();
  Pair* end = all;
  for (const Buffer<Pair>& part : found) end = std::copy(part.begin(), part.end(), end);
  if (count <= few_pairs) {
    std::sort(all, end, [](Pair a, Pair b) { return a << 1 < b << 1; });
  } else {
    int bits = 1;
    while ((slots - 1) >> bits) ++bits;
    scratch.resizeDiscarding(count);
    radixSort(all, scratch.data(), count, 0, bits, threads);
    radixSort(all, scratch.data(), count, 32, bits, threads);
  }
  noteBorderline(all, {0, 0, count}, pairs.borderline);
}

}  // namespace ode_parallel_sap
