// What each measure spares in a yard: scene [--layers] [--apart] [--asleep] [--substeps]
// [--proxies] [--size X] [--frames N]. See README.md.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "yard.h"

namespace scene {
namespace {

struct Measure {
  const char *flag, *what;
  bool Measures::*member;
};
constexpr Measure measures[] = {
    {"--layers", "categories as layers", &Measures::layers},
    {"--apart", "static world apart", &Measures::apart},
    {"--asleep", "who rests sleeps", &Measures::asleep},
    {"--substeps", "sub-steps of the fast only", &Measures::substeps},
    {"--proxies", "coarse proxies far away", &Measures::proxies},
};

struct Options {
  Measures chosen;
  bool any = false;
  double size = 1;
  int frames = 20;
};

constexpr int settling_frames = 60;

struct Result {
  double pairs = 0, contacts = 0, ms = 0;  // a frame
  int behind = 0;                          // bullets behind the wall
};

Result measure(const Measures& chosen, const Options& options) {
  Yard yard(chosen, options.size);
  yard.settle(settling_frames);
  yard.shoot();
  Result result;
  std::vector<double> times;
  for (int frame = 0; frame < options.frames; ++frame) {
    const Work work = yard.frame();
    result.pairs += static_cast<double>(work.pairs) / options.frames;
    result.contacts += static_cast<double>(work.contacts) / options.frames;
    times.push_back(work.ms);
  }
  std::sort(times.begin(), times.end());
  result.ms = times[times.size() / 2];
  result.behind = yard.behindWall();
  return result;
}

Result printRow(const char* what, const Measures& chosen, const Options& options,
                const Result* plain) {
  const Result result = measure(chosen, options);
  std::printf("%-28s %10.0f %10.0f %10.3f", what, result.pairs, result.contacts, result.ms);
  if (plain)
    std::printf("  %5.1f %%  %5.1f %%", 100 * (1 - result.pairs / plain->pairs),
                100 * (1 - result.ms / plain->ms));
  else
    std::printf("        -        -");
  std::printf("  %d\n", result.behind);
  std::fflush(stdout);
  return result;
}

void printTable(const Options& options) {
  std::printf("%-28s %10s %10s %10s  %7s  %7s  %s\n", "a frame of 10 ms", "pairs", "contacts", "ms",
              "pairs", "ms", "bullets");
  std::printf("%-28s %10s %10s %10s  %7s  %7s  %s\n", "", "", "", "", "saved", "saved", "behind");
  const Result plain = printRow("nothing done", {}, options, nullptr);
  if (options.any) {
    printRow("what was asked for", options.chosen, options, &plain);
    return;
  }
  Measures all;
  for (const Measure& measure : measures) {
    Measures one;
    one.*measure.member = all.*measure.member = true;
    printRow(measure.what, one, options, &plain);
  }
  printRow("all of these", all, options, &plain);
  Measures tunnel;
  tunnel.tunnel = true;
  printRow("(no sub-steps at all)", tunnel, options, &plain);
}

// A number of at least `least`, or nothing.
bool read(const char* text, double least, double most, double& number) {
  char* end = nullptr;
  const double value = text ? std::strtod(text, &end) : least - 1;
  if (!text || end == text || *end || !(value >= least && value <= most)) return false;
  number = value;
  return true;
}

bool parse(int argc, char** argv, Options& options) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const char* const next = i + 1 < argc ? argv[i + 1] : nullptr;
    const Measure* const known =
        std::find_if(std::begin(measures), std::end(measures),
                     [&](const Measure& measure) { return word == measure.flag; });
    double frames = 0;
    if (known != std::end(measures))
      options.any = options.chosen.*known->member = true;
    else if (word == "--size" && read(next, 0.05, 100, options.size))
      ++i;
    else if (word == "--frames" && read(next, 1, 100000, frames))
      options.frames = static_cast<int>(frames), ++i;
    else
      return false;
  }
  return true;
}

}  // namespace
}  // namespace scene

int main(int argc, char** argv) {
  scene::Options options;
  if (!scene::parse(argc, argv, options)) {
    std::fprintf(stderr,
                 "usage: scene [--layers] [--apart] [--asleep] [--substeps] [--proxies] "
                 "[--size 0.05..100] [--frames 1..100000]\n");
    return 2;
  }
  dInitODE2(0);
  scene::printTable(options);
  dCloseODE();
  return 0;
}
