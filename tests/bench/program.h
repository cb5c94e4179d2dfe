// What all benchmarks share: options, the loop that times frames, and rows.
#pragma once

#include <ode/ode.h>
#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "csv.h"

namespace bench {

class Stopwatch {
 public:
  double milliseconds() const {
    const std::chrono::duration<double, std::milli> passed =
        std::chrono::steady_clock::now() - start_;
    return passed.count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Contenders take turns. Each is made anew for a turn and plays its frames alone.
struct Timing {
  int rounds = 2;        // turns of each
  double seconds = 0.5;  // of timed frames in a turn
  long frames = 0;       // timed in a turn at most; 0: as many as fill it
  CsvFile csv;
};

// Plays the frames of a turn: some that are not timed, then at least one, up to three within a
// second, and as many as fill the turn or as are asked for. next() returns milliseconds, which are
// added to `times`.
template <class Next>
void timeFrames(std::vector<double>& times, int untimed, const Timing& timing, Next next) {
  for (int frame = 0; frame < untimed; ++frame) next();
  double spent = 0;
  const auto goesOn = [&](long frame) {
    return spent < 1000 * timing.seconds || (frame < 3 && spent < 1000);
  };
  for (long frame = 0; frame == 0 || (frame != timing.frames && goesOn(frame)); ++frame) {
    times.push_back(next());
    spent += times.back();
  }
}

// A dNearCallback; `pairs` points to a std::size_t.
inline void countPair(void* pairs, dGeomID, dGeomID) {
  ++*static_cast<std::size_t*>(pairs);
}

// The options of a benchmark, and its way from them to an exit code.
class Program : public CLI::App {
 public:
  // --help shows what a value is unless it is set.
  explicit Program(const std::string& about) : App(about) {
    option_defaults()->always_capture_default();
  }

  void addTiming(Timing& timing) {
    add_option("--rounds", timing.rounds, "turns of each contender");
    add_option("--seconds", timing.seconds, "of timed frames in a turn");
    add_option("--frames", timing.frames, "timed in a turn at most; 0: as many as fill it");
    add_option("--csv", timing.csv.path, "file to write");
    add_flag("--append", timing.csv.append, "to what the file holds");
  }

  // Reads the options, calls work() between dInitODE2() and dCloseODE(), and returns the program's
  // exit code: 1 with a message if work() throws, that of CLI11 if the options are wrong.
  template <class Work>
  int run(int argc, char** argv, Work work) {
    CLI11_PARSE(*this, argc, argv);
    dInitODE2(0);
    int result = 0;
    try {
      work();
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      result = 1;
    }
    dCloseODE();
    return result;
  }
};

}  // namespace bench
