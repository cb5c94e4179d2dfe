// The command line of pair-benchmark.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace bench {

struct Options {
  std::vector<std::string> scenes{"dense-cube"};
  std::vector<std::string> peers;  // empty: all
  std::vector<std::size_t> sizes{1000, 10000, 100000};
  std::vector<int> threads{1};
  int devices = 0;     // GPUs for the back ends that use some; 0: their own choice
  int batch = 0;       // frames in one clock reading; 0: each find has its own
  bool still = false;  // nothing moves, and nobody says so
  double moving = 1;   // part of the boxes that moves
  double budget = 1;   // seconds of timed work in a cell
  double limit = 60;   // seconds that one find may take
  int rounds = 2;      // times each peer of a cell has its turn
  std::uint64_t seed = 1;
  std::string csv;
  bool append = false;
  std::string piles;  // the directory of recorded piles
  std::string trace;  // a file that dParallelSAPSpaceSetTrace wrote
  bool list = false;
};

// The one of this run.
Options& options();

// Takes out of argv what it understands and leaves the rest, which is for Google Benchmark. Prints
// what is wrong and exits with 2; --help prints the usage and exits with 0.
void parseOptions(int& argc, char** argv);

}  // namespace bench
