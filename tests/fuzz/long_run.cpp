// Random edits of random worlds, every collide compared with the oracle:
//
//     long-run [edits [seed]]
//     long-run --replay FILE...    plays inputs of the fuzz target, which a fuzzer found
//
// A world lives for some two hundred edits; its seed is printed when it shows something wrong, and
// `long-run 1 seed` plays that world again.
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>

#include "driver.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);

namespace {

constexpr int kEditsOfAWorld = 200;
// The quadratic oracle would take all of the time in worlds that are mostly large.
constexpr std::size_t kGeoms[] = {30, 60, 120, 250, 400, 800, 3200};

struct Totals {
  unsigned long edits = 0, changes = 0, collides = 0, trembling = 0, candidates_kept = 0,
                touches = 0;
};

bool live(std::uint64_t seed, Totals& totals) {
  using namespace sap_test;
  Decisions decisions(seed);
  const std::size_t most = kGeoms[Random(seed).below(std::size(kGeoms))];
  Driver driver(decisions, most);
  for (int edit = 0; edit < kEditsOfAWorld && driver.problem().empty(); ++edit) {
    driver.step();
    ++totals.edits;
  }
  if (driver.problem().empty()) driver.finish();
  totals.changes += driver.changes();
  totals.collides += driver.collides();
  totals.trembling += driver.trembling();
  totals.candidates_kept += driver.candidatesKept();
  totals.touches += driver.touches();
  if (driver.problem().empty()) return true;
  std::printf("%sin the world of seed %llu: long-run 1 %llu plays it again\n",
              driver.problem().c_str(), static_cast<unsigned long long>(seed),
              static_cast<unsigned long long>(seed));
  return false;
}

// Frames that were to be found from kept candidates, and how many were. In so few worlds as a short
// run has all may hold rays or what is far away.
bool reachesFatProxies(const Totals& totals) {
  constexpr unsigned long kEnoughFrames = 300;
  const bool enough =
      totals.trembling < kEnoughFrames || 5 * totals.candidates_kept >= totals.trembling;
  std::printf("%lu of %lu frames of trembling worlds found from kept candidates%s\n",
              totals.candidates_kept, totals.trembling, enough ? "" : ": TOO FEW");
  return enough;
}

int run(unsigned long edits, std::uint64_t seed) {
  Totals totals;
  bool right = true;
  const std::uint64_t first = seed;
  while (right && totals.edits < edits) {
    right = live(seed++, totals);
    if ((seed - first) % 200 == 0) std::fprintf(stderr, "%lu edits\n", totals.edits);
  }
  std::printf(
      "%lu edits of %llu worlds, %lu changes in all, %lu collides compared, %lu touches: %s\n",
      totals.edits, static_cast<unsigned long long>(seed - first), totals.changes, totals.collides,
      totals.touches, right ? "all exact" : "WRONG");
  return right && reachesFatProxies(totals) ? 0 : 1;
}

int replay(int count, char** names) {
  for (int i = 0; i < count; ++i) {
    std::ifstream file(names[i], std::ios::binary);
    if (!file) {
      std::fprintf(stderr, "cannot read %s\n", names[i]);
      return 2;
    }
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    std::printf("%s: exact\n", names[i]);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::strcmp(argv[1], "--replay") == 0) return replay(argc - 2, argv + 2);
  if (argc > 3 || std::any_of(argv + 1, argv + argc, [](const char* word) {
        return !*word || word[std::strspn(word, "0123456789")];
      })) {
    std::fputs("long-run [EDITS [SEED]], or long-run --replay FILE...\n", stderr);
    return 2;
  }
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  const int result =
      run(argc > 1 ? std::stoul(argv[1]) : 20000, argc > 2 ? std::stoul(argv[2]) : 1);
  dCloseODE();
  return result;
}
