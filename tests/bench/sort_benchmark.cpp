// The sort of this library against those of others, on what it sorts: records of a key along a
// curve and a slot. And how long it puts pairs in order.
#include <parallel/algorithm>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#ifdef BENCH_HAS_TBB
#include <tbb/global_control.h>
#include <tbb/parallel_sort.h>
#endif

#include "csv.h"
#include "machine.h"
#include "program.h"
#include "random.h"
#include "space/simd/kernels.h"
#include "space/sort/pair_order.h"
#include "space/sort/radix_sort.h"
#include "stopwatch.h"

namespace bench {
namespace {

using Records = std::vector<std::uint64_t>;
constexpr int key_bits = 24;  // of a class of boxes at most

Records makeRecords(std::size_t n) {
  sap_test::Random random(1);
  Records records(n);
  for (std::size_t i = 0; i < n; ++i)
    records[i] = random.below(std::size_t{1} << key_bits) << 32 | i;
  return records;
}

struct Sort {
  const char* name;
  std::function<void(Records& records, Records& scratch, int threads)> run;
};

const std::vector<Sort>& sorts() {
  static const std::vector<Sort> all = {
      {"radixSort",
       [](Records& records, Records& scratch, int threads) {
         ode_parallel_sap::radixSort(records.data(), scratch.data(), records.size(), 32, key_bits,
                                     threads);
       }},
      {"std::sort",
       [](Records& records, Records&, int) { std::sort(records.begin(), records.end()); }},
      {"__gnu_parallel::sort",
       [](Records& records, Records&, int threads) {
         __gnu_parallel::sort(records.begin(), records.end(),
                              __gnu_parallel::default_parallel_tag(threads));
       }},
#ifdef BENCH_HAS_TBB
      {"tbb::parallel_sort",
       [](Records& records, Records&, int threads) {
         const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
         tbb::parallel_sort(records.begin(), records.end());
       }},
#endif
  };
  return all;
}

struct Wishes {
  std::vector<std::size_t> sizes{10000, 100000, 1000000};
  std::vector<double> pairs_a_box{0.25, 1, 4.5, 12.5};
  std::vector<int> threads{1, 2};
  double seconds = 0.5;  // a cell
  CsvFile csv;
};

// Milliseconds of sort() after each prepare(), but for the first turn.
template <class Prepare, class Sort, class Check>
std::vector<double> timesOf(double seconds, Prepare prepare, Sort sort, Check check) {
  std::vector<double> times;
  double spent = 0;
  for (int turn = 0; turn < 4 || spent < 1000 * seconds; ++turn) {
    prepare();
    const Stopwatch clock;
    sort();
    const double time = clock.milliseconds();
    check();
    if (turn > 0) times.push_back(time);
    spent += time;
  }
  return times;
}

void tell(const std::string& sort, std::size_t n, std::size_t items, int threads,
          const std::vector<double>& times, Csv& csv) {
  const double ms = median(times);
  std::printf("%-30s %9zu %7d %12.4f %12.2f\n", sort.c_str(), n, threads, ms,
              1e6 * ms / static_cast<double>(items));
  csv.write(
      Row().add("sort", sort).add("n", n).add("threads", threads).addTimes(times).addMachine());
}

void sortRecords(std::size_t n, const Wishes& wishes, Csv& csv) {
  const Records records = makeRecords(n);
  Records expected = records, scratch(n), sorted;
  std::sort(expected.begin(), expected.end());
  for (const int threads : wishes.threads)
    for (const Sort& sort : sorts())
      tell(sort.name, n, n, threads,
           timesOf(
               wishes.seconds, [&] { sorted = records; },
               [&] { sort.run(sorted, scratch, threads); },
               [&] {
                 if (sorted != expected)
                   throw std::runtime_error(std::string(sort.name) + " does not sort");
               }),
           csv);
}

using ode_parallel_sap::Pair;
using Found = std::vector<ode_parallel_sap::Buffer<Pair>>;

// As the sweep finds them, in a part a thread: box after box along a curve, each with some of the
// boxes behind it. Slots along the curve are in no order.
Found makePairs(std::size_t boxes, double a_box, std::size_t parts) {
  constexpr std::size_t reach = 1500;  // places along the curve
  sap_test::Random random(1);
  std::vector<ode_parallel_sap::Slot> slots(boxes);
  for (std::size_t i = 0; i < boxes; ++i) {
    slots[i] = static_cast<ode_parallel_sap::Slot>(i);
    std::swap(slots[i], slots[random.below(i + 1)]);
  }
  Found found(parts);
  for (std::size_t place = 0; place < boxes; ++place) {
    const auto whole = static_cast<std::size_t>(a_box);
    const std::size_t pairs = whole + random.chance(a_box - static_cast<double>(whole));
    for (std::size_t i = 0; i < pairs; ++i) {
      const std::size_t other = place + 1 + i * reach / pairs + random.below(reach / pairs);
      if (other >= boxes) break;
      const auto ends = std::minmax(slots[place], slots[other]);
      found[place * parts / boxes].push_back(ode_parallel_sap::makePair(ends.first, ends.second));
    }
  }
  return found;
}

// With each set of instructions, as some have registers that sort.
void sortPairs(std::size_t boxes, const Wishes& wishes, Csv& csv) {
  for (const int threads : wishes.threads)
    for (const double a_box : wishes.pairs_a_box) {
      const Found found = makePairs(boxes, a_box, static_cast<std::size_t>(threads));
      std::size_t count = 0;
      for (const auto& part : found) count += part.size();
      const ode_parallel_sap::KernelSet& best = ode_parallel_sap::kernelSet();
      for (auto set = ode_parallel_sap::allKernelSets(); *set; ++set) {
        ode_parallel_sap::chooseKernelSet(**set);
        ode_parallel_sap::PairOrder order;
        ode_parallel_sap::PairList sorted;
        char name[64];
        std::snprintf(name, sizeof name, "PairOrder %g a box %s", a_box, (*set)->name);
        tell(name, boxes, count, threads,
             timesOf(
                 wishes.seconds, [] {}, [&] { order.sort(found, boxes, threads, sorted); },
                 [&] {
                   const auto& pairs = sorted.parts[0];
                   if (sorted.size() != count || pairs.size() != count ||
                       !std::is_sorted(pairs.begin(), pairs.end()))
                     throw std::runtime_error("PairOrder does not sort");
                 }),
             csv);
      }
      ode_parallel_sap::chooseKernelSet(best);
    }
}

void run(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%-30s %9s %7s %12s %12s\n", "sort", "n", "threads", "median ms", "ns an item");
  for (const std::size_t n : wishes.sizes) sortRecords(n, wishes, csv);
  for (const std::size_t n : wishes.sizes) sortPairs(n, wishes, csv);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program(
      "sort-benchmark: this library's sort of keys along a curve against other libraries', and its "
      "order of pairs");
  program.add("--sizes", wishes.sizes, "records, and boxes that have pairs");
  program.add("--pairs", wishes.pairs_a_box, "pairs a box");
  program.add("--threads", wishes.threads)->check(CLI::PositiveNumber);
  program.add("--seconds", wishes.seconds, "of sorting, a cell");
  program.add(wishes.csv);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
