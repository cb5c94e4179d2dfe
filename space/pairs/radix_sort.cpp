#include "space/pairs/radix_sort.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/pairs/tuning.h"

namespace ode_parallel_sap {

namespace {

Region counting("radix sort: counts"), scattering("radix sort: scatter"),
    copying("radix sort: copy");

struct Digit {
  int low_bit, bits;
};

// One stable counting pass. Each thread counts and later scatters one part of the input; the
// counters become positions by a scan over digits first, threads second.
void countingPass(const std::uint64_t* from, std::uint64_t* to, std::size_t count,
                  const Digit& digit_of, int threads, std::vector<std::uint32_t>& positions) {
  const int low_bit = digit_of.low_bit;
  const std::size_t digits = std::size_t{1} << digit_of.bits;
  const std::uint64_t mask = digits - 1;
  positions.assign(digits * threads, 0);
  const int parts = runTeam(counting, threads, [&](int thread, int team) {
    const Range range = ownPart(count, thread, team);
    std::uint32_t* const counts = positions.data() + digits * thread;
    for (std::size_t i = range.begin; i < range.end; ++i) ++counts[from[i] >> low_bit & mask];
  });
  std::uint32_t position = 0;
  for (std::size_t digit = 0; digit < digits; ++digit)
    for (int part = 0; part < parts; ++part)
      position += std::exchange(positions[digits * part + digit], position);
  // The parts are those of the count, whoever takes them.
  runTeam(scattering, parts, [&](int thread, int team) {
    for (int part = thread; part < parts; part += team) {
      const Range range = ownPart(count, part, parts);
      std::uint32_t* const next = positions.data() + digits * part;
      for (std::size_t i = range.begin; i < range.end; ++i)
        to[next[from[i] >> low_bit & mask]++] = from[i];
    }
  });
}

// The same on one thread, with counters small enough to be cleared for a few hundred records.
void sortAlone(std::uint64_t* records, std::uint64_t* scratch, std::size_t count, int low_bit,
               int bits) {
  std::uint32_t next[1 << most_digits_alone];
  const int passes = (bits + most_digits_alone - 1) / most_digits_alone;
  std::uint64_t *from = records, *to = scratch;
  for (int pass = 0, done = 0; pass < passes; ++pass) {
    const int digit_bits = (bits - done + passes - pass - 1) / (passes - pass);
    const int shift = low_bit + done;
    const std::size_t digits = std::size_t{1} << digit_bits;
    std::fill(next, next + digits, 0);
    for (std::size_t i = 0; i < count; ++i) ++next[from[i] >> shift & (digits - 1)];
    std::uint32_t position = 0;
    for (std::size_t digit = 0; digit < digits; ++digit)
      position += std::exchange(next[digit], position);
    for (std::size_t i = 0; i < count; ++i) to[next[from[i] >> shift & (digits - 1)]++] = from[i];
    std::swap(from, to);
    done += digit_bits;
  }
  if (from != records) std::memcpy(records, from, count * sizeof *records);
}

}  // namespace

void radixSort(std::uint64_t* records, std::uint64_t* scratch, std::size_t count, int low_bit,
               int bits, int threads) {
  if (count < 2 || bits <= 0) return;
  threads = teamFor(count, grains::sorted_records, threads);
  if (threads == 1) {
    sortAlone(records, scratch, count, low_bit, bits);
    return;
  }
  const int passes = (bits + most_digits - 1) / most_digits;
  std::vector<std::uint32_t> positions;
  std::uint64_t *from = records, *to = scratch;
  for (int pass = 0, done = 0; pass < passes; ++pass) {
    const int digit_bits = (bits - done + passes - pass - 1) / (passes - pass);
    countingPass(from, to, count, {low_bit + done, digit_bits}, threads, positions);
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

}  // namespace ode_parallel_sap
