// What the main functions of the benchmarks share.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

namespace bench {

// Reads the options, calls work() and returns the program's exit code: 1 with a message if work()
// throws, that of CLI11 if the options are wrong.
template <class Work>
int runProgram(CLI::App& app, int argc, char** argv, Work work) {
  CLI11_PARSE(app, argc, argv);
  try {
    work();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}

}  // namespace bench
