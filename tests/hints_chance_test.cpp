// What is said to save time does not come of chance: of one callback that another program
// interrupted.
#include <string>

#include "space/frame/hints.h"
#include "support/catch.hpp"

using ode_parallel_sap::FrameSums;
using ode_parallel_sap::hintsOf;
using ode_parallel_sap::SampledPairs;

namespace {

FrameSums::Sums framesOfCallbacks() {
  FrameSums::Sums frames;
  frames.frames = 1000;
  frames.pairs = 6e6;
  frames.extract_ms = 100;
  frames.report_ms = 9900;
  frames.total_ms = 10000;
  return frames;
}

// Of so many pairs that take 3 us each, `count` are static and take nothing, but for some.
SampledPairs staticPairs(unsigned count, unsigned long_ones, double long_ms, unsigned all = 1500) {
  SampledPairs seen;
  for (unsigned i = 0; i < all; ++i) {
    const bool is_static = i < count;
    const double ms = !is_static ? 0.003 : i < long_ones ? long_ms : 0.00001;
    const SampledPairs::Kind one = {1, 0, 0, ms, ms * ms};
    seen.all.add(one);
    if (is_static) seen.of_static.add(one);
  }
  return seen;
}

}  // namespace

TEST_CASE("Few long callbacks among many short ones are no hint", "[hints]") {
  // At most a hundred times as long as the mean, as they are taken for no longer.
  for (const double long_ms : {0.05, 0.1, 0.3})
    for (const unsigned long_ones : {0u, 1u, 2u, 4u}) {
      INFO(long_ones << " of " << long_ms << " ms");
      CHECK(hintsOf(framesOfCallbacks(), staticPairs(75, long_ones, long_ms)) == "");
    }
}

TEST_CASE("Callbacks that are long as a rule are a hint", "[hints]") {
  // As long as the others, or ten times as long for every fifth.
  for (const unsigned count : {40u, 75u, 700u})
    for (const unsigned long_ones : {count, count / 5}) {
      if (count == 40 && long_ones < count) continue;  // eight are chance
      const double long_ms = long_ones == count ? 0.003 : 0.03;
      const std::string line = hintsOf(framesOfCallbacks(), staticPairs(count, long_ones, long_ms));
      INFO(long_ones << " of " << long_ms << " ms among " << count << ": " << line);
      CHECK(line.find("ODE_PARALLEL_SAP_SKIP_STATIC=1") != std::string::npos);
    }
}

TEST_CASE("Where all pairs are of a kind there is no chance in it", "[hints]") {
  for (const unsigned all : {16u, 100u, 400u}) {
    const std::string line = hintsOf(framesOfCallbacks(), staticPairs(all, 1, 0.3, all));
    INFO(all << ": " << line);
    CHECK(line.find(" 100 % by ODE_PARALLEL_SAP_SKIP_STATIC=1") != std::string::npos);
  }
}

TEST_CASE("What finding the pairs takes is saved whatever the callbacks", "[hints]") {
  FrameSums::Sums frames = framesOfCallbacks();
  frames.extract_ms = 2000;
  frames.report_ms = 8000;
  const std::string line = hintsOf(frames, staticPairs(300, 1, 3.0));
  INFO(line);
  CHECK(line.find("ODE_PARALLEL_SAP_SKIP_STATIC=1") != std::string::npos);
}
