// What the main functions of the benchmarks share.
#pragma once

#include <ode/ode.h>
#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "csv.h"

namespace bench {

// The options of a benchmark, and its way from them to an exit code.
class Program {
 public:
  explicit Program(const std::string& about) : app_(about) {}

  // --help shows what a value is unless it is set. Lists are given with commas.
  template <class T>
  CLI::Option* add(const std::string& name, T& value, const std::string& about = "") {
    return app_.add_option(name, value, about)->capture_default_str();
  }
  template <class T>
  CLI::Option* add(const std::string& name, std::vector<T>& list, const std::string& about = "") {
    return app_.add_option(name, list, about)->delimiter(',')->capture_default_str();
  }
  CLI::Option* add(const std::string& name, bool& flag, const std::string& about = "") {
    return app_.add_flag(name, flag, about);
  }
  void add(CsvFile& csv) {
    add("--csv", csv.path, "file to write");
    add("--append", csv.append, "to what the file holds");
  }

  // Reads the options, calls work() between dInitODE2() and dCloseODE(), and returns the program's
  // exit code: 1 with a message if work() throws, that of CLI11 if the options are wrong.
  template <class Work>
  int run(int argc, char** argv, Work work) {
    CLI11_PARSE(app_, argc, argv);
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

 private:
  CLI::App app_;
};

}  // namespace bench
