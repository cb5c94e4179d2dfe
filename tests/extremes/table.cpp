// What becomes of ODE's spaces and of ours at every extreme, as a table:
//
//     extremes-table [table.md]
//
// plays every extreme on every kind of space, each in a process of its own, since some end in an
// abort, a crash or no end at all. Extremes at which all are exact have no row. With a file's name
// it replaces the text there between <!-- table --> and <!-- end -->. Ends with 1 if ours was not
// exact everywhere.
#include <ode_parallel_sap/parallel_sap_space.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdarg>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "extreme.h"

namespace sap_test {
namespace {

constexpr std::size_t kGeoms = 1000;
constexpr int kSeconds = 10;
constexpr std::size_t kMemory = std::size_t{4} << 30;

struct Kind {
  const char* name;
  dSpaceID (*make)(dSpaceID parent);
};

dSpaceID makeQuadTree(dSpaceID parent) {
  const dVector3 centre = {0, 0, 0, 0}, extents = {100, 100, 100, 0};
  return dQuadTreeSpaceCreate(parent, centre, extents, 5);
}

const Kind kKinds[] = {
    {"dSimpleSpace", dSimpleSpaceCreate},
    {"dHashSpace", dHashSpaceCreate},
    {"dSweepAndPruneSpace",
     [](dSpaceID parent) { return dSweepAndPruneSpaceCreate(parent, dSAP_AXES_XYZ); }},
    {"dQuadTreeSpace", makeQuadTree},
    {"dParallelSAPSpace", dParallelSAPSpaceCreate}};
constexpr std::size_t kOurs = 4;

// All frames together; the order of pairs and of their arguments is ours to promise alone.
struct Tally {
  std::size_t missed = 0, extra = 0, repeated = 0;

  void add(Pairs got, Pairs expected, bool in_order) {
    const bool same = got == expected;
    got = asSet(got);
    const auto end = std::unique(got.begin(), got.end());
    repeated += static_cast<std::size_t>(got.end() - end);
    got.erase(end, got.end());
    expected = asSet(expected);
    Pairs difference;
    std::set_difference(expected.begin(), expected.end(), got.begin(), got.end(),
                        std::back_inserter(difference));
    missed += difference.size();
    difference.clear();
    std::set_difference(got.begin(), got.end(), expected.begin(), expected.end(),
                        std::back_inserter(difference));
    extra += difference.size();
    if (in_order && !same && missed + extra + repeated == 0) {
      throw std::runtime_error("out of order");
    }
  }

  std::string text() const {
    std::string text;
    const auto say = [&](std::size_t count, const char* what) {
      if (count) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
    };
    say(missed, "missed");
    say(extra, "extra");
    say(repeated, "repeated");
    return text.empty() ? "exact" : text;
  }
};

int answer_to = -1;

[[noreturn]] void answer(const std::string& text) {
  const ssize_t written = write(answer_to, text.data(), text.size());
  // No destructors: a space that is still locked would abort in its own.
  _exit(written == static_cast<ssize_t>(text.size()) ? 0 : 1);
}

void answerAborted(int, const char*, va_list) {
  answer("aborts");
}

void say_nothing(int, const char*, va_list) {}

[[noreturn]] void playInThisProcess(const Extreme& extreme, std::size_t kind) {
  const rlimit memory = {kMemory, kMemory};
#if !defined(__SANITIZE_ADDRESS__)  // which reserves more than that
  setrlimit(RLIMIT_AS, &memory);
#else
  (void)memory;
#endif
  dSetDebugHandler(answerAborted);
  dSetErrorHandler(answerAborted);
  dSetMessageHandler(say_nothing);
  try {
    Scene scene(kKinds[kind].make, std::min(kGeoms, extreme.most), 1);
    Tally tally;
    for (int frame = 0; frame < extreme.frames; ++frame) {
      extreme.play(scene, frame);
      Pairs got;
      {
        const FloatingPointMode mode(extreme.mode);
        got = extreme.collide(scene);
      }
      tally.add(got, expectedPairs(scene), kind == kOurs);
    }
    answer(tally.text());
  } catch (const std::exception& problem) {
    answer(problem.what());
  }
}

std::string play(const Extreme& extreme, std::size_t kind) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    close(ends[0]);
    answer_to = ends[1];
    alarm(kSeconds);
    playInThisProcess(extreme, kind);
  }
  close(ends[1]);
  char buffer[200];
  const ssize_t length = read(ends[0], buffer, sizeof buffer);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (length > 0) return std::string(buffer, static_cast<std::size_t>(length));
  if (!WIFSIGNALED(status)) return "exits";
  if (WTERMSIG(status) == SIGALRM) return "no end in " + std::to_string(kSeconds) + " s";
  return WTERMSIG(status) == SIGABRT ? "aborts" : "crashes";
}

std::string table(bool& exact) {
  std::ostringstream text;
  text << "| |";
  for (const Kind& kind : kKinds) text << " " << kind.name << " |";
  text << "\n| --- |";
  for (std::size_t i = 0; i < std::size(kKinds); ++i) text << " --- |";
  text << "\n";
  std::size_t all_exact = 0;
  for (const Extreme& extreme : extremes()) {
    std::string row = std::string("| ") + extreme.name + " |";
    bool differs = false;
    for (std::size_t kind = 0; kind < std::size(kKinds); ++kind) {
      const std::string result = play(extreme, kind);
      if (result != "exact") differs = true;
      if (kind == kOurs && result != "exact") exact = false;
      row += " " + result + " |";
      std::cerr << extreme.theme << ": " << extreme.name << ", " << kKinds[kind].name << ": "
                << result << std::endl;
    }
    if (differs)
      text << row << "\n";
    else
      ++all_exact;
  }
  text << "\nExact in all spaces: " << all_exact << " more extremes.\n";
  return text.str();
}

void replaceIn(const std::string& file, const std::string& table) {
  std::stringstream old;
  old << std::ifstream(file).rdbuf();
  const std::string text = old.str(), begin = "<!-- table -->\n", end = "<!-- end -->\n";
  const std::size_t from = text.find(begin), to = text.find(end);
  if (from == std::string::npos || to == std::string::npos || to < from) {
    throw std::runtime_error(file + " has no <!-- table --> and <!-- end -->");
  }
  std::ofstream(file) << text.substr(0, from) << begin << "\n" << table << "\n" << text.substr(to);
}

int run(int argc, char** argv) {
  if (argc > 2) {
    std::cerr << "usage: " << argv[0] << " [table.md]\n";
    return 2;
  }
  bool exact = true;
  const std::string text = table(exact);
  if (argc == 2) {
    replaceIn(argv[1], text);
  } else {
    std::cout << text;
  }
  return exact ? 0 : 1;
}

}  // namespace
}  // namespace sap_test

int main(int argc, char** argv) try {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  return sap_test::run(argc, argv);
} catch (const std::exception& problem) {
  std::cerr << argv[0] << ": " << problem.what() << "\n";
  return 2;
}
