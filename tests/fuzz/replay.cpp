// The fuzz target without a fuzzer:
//
//     fuzz-replay FILE...                  plays inputs, for instance one that a fuzzer found
//     fuzz-replay --seconds N [--seed S]   plays random bytes for so long
//
// The random input that was played last is left in the file fuzz-replay.input if it failed.
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "decisions.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes randomBytes(std::uint64_t seed) {
  sap_test::Random random(seed);
  Bytes bytes(random.below(random.chance(0.1) ? 2000 : 300));
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.bits() >> 32);
  return bytes;
}

int playRandom(double seconds, std::uint64_t seed) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  unsigned long inputs = 0;
  while (std::chrono::duration<double>(Clock::now() - begin).count() < seconds) {
    const Bytes bytes = randomBytes(seed++);
    std::ofstream("fuzz-replay.input", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
    ++inputs;
  }
  std::remove("fuzz-replay.input");
  std::printf("%lu inputs, all exact; the next seed is %llu\n", inputs,
              static_cast<unsigned long long>(seed));
  return 0;
}

int playFiles(int count, char** names) {
  for (int i = 0; i < count; ++i) {
    std::ifstream file(names[i], std::ios::binary);
    if (!file) throw std::runtime_error(std::string("cannot read ") + names[i]);
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    const Bytes bytes(text.begin(), text.end());
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
    std::printf("%s: exact\n", names[i]);
  }
  return 0;
}

int run(int argc, char** argv) {
  if (argc < 2) throw std::invalid_argument("no arguments");
  if (std::strcmp(argv[1], "--seconds") != 0) return playFiles(argc - 1, argv + 1);
  const bool seeded = argc == 5 && std::strcmp(argv[3], "--seed") == 0;
  if (argc != 3 && !seeded) throw std::invalid_argument("wrong arguments");
  return playRandom(std::stod(argv[2]), seeded ? std::stoull(argv[4]) : 1);
}

}  // namespace

int main(int argc, char** argv) try {
  return run(argc, argv);
} catch (const std::exception& problem) {
  std::fprintf(stderr, "%s\nusage: %s FILE... | --seconds N [--seed S]\n", problem.what(), argv[0]);
  return 2;
}
