// The sort of this library against those of others, on what it sorts: records of a key along a
// curve and a slot.
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
  std::vector<int> threads{1, 2};
  double seconds = 0.5;  // a cell
  CsvFile csv;
};

void run(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%-22s %9s %7s %12s %12s\n", "sort", "records", "threads", "median ms",
              "ns a record");
  for (const std::size_t n : wishes.sizes) {
    const Records records = makeRecords(n);
    Records expected = records, scratch(n);
    std::sort(expected.begin(), expected.end());
    for (const int threads : wishes.threads)
      for (const Sort& sort : sorts()) {
        std::vector<double> times;
        double spent = 0;
        for (int turn = 0; turn < 4 || spent < 1000 * wishes.seconds; ++turn) {
          Records sorted = records;
          const Stopwatch clock;
          sort.run(sorted, scratch, threads);
          const double time = clock.milliseconds();
          if (sorted != expected)
            throw std::runtime_error(std::string(sort.name) + " does not sort");
          if (turn > 0) times.push_back(time);
          spent += time;
        }
        const double ms = median(times);
        std::printf("%-22s %9zu %7d %12.4f %12.2f\n", sort.name, n, threads, ms,
                    1e6 * ms / static_cast<double>(n));
        csv.write(Row()
                      .add("sort", sort.name)
                      .add("n", n)
                      .add("threads", threads)
                      .addTimes(times)
                      .addMachine());
      }
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program(
      "sort-benchmark: this library's sort of keys along a curve against other libraries'");
  program.add("--sizes", wishes.sizes, "records");
  program.add("--threads", wishes.threads)->check(CLI::PositiveNumber);
  program.add("--seconds", wishes.seconds, "of sorting, a cell");
  program.add(wishes.csv);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
