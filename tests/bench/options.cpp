#include "options.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <stdexcept>

namespace bench {
namespace {

const char usage[] =
    R"(pair-benchmark: time to find the overlapping pairs of moving boxes

  --scenes=a,b,...    what is in motion (all: every scene); default dense-cube
  --sizes=n,n,...     boxes; default 1000,10000,100000
  --peers=a,b,...     who finds the pairs; default: all there are
  --threads=t,t,...   for the peers that take a number of threads; 0: as many as a user gets who sets
                      none, for ours only; default 1
  --devices=d         GPUs for the back ends that use some; default 0: their own choice
  --batch=f           f frames in one clock reading, moving included and told apart: for small scenes
  --moving=p          part of the boxes that moves, always the same ones; default 1
  --still             nothing moves, and no library is told of boxes again
  --budget=s          seconds of timed work in a cell; default 1
  --limit=s           leave out what would need more seconds for one find; default 60
  --rounds=r          turns of each peer in a cell; default 2
  --seed=s
  --csv=file          one row a cell; --append to add to it
  --piles=directory   where recorded piles (*.pile) are; default: beside the program
  --trace=file        the scene "trace": what dParallelSAPSpaceSetTrace wrote
  --list              names of scenes and peers, and what they are
  --quick             the same as --budget=0.1 --rounds=1

Flags of Google Benchmark (--benchmark_...) work too.
)";

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find(',', begin)) != std::string::npos; begin = end + 1)
    parts.push_back(text.substr(begin, end - begin));
  parts.push_back(text.substr(begin));
  return parts;
}

double numberIn(const std::string& text, double least) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end || !(value >= least)) throw std::invalid_argument(text);
  return value;
}

template <class T>
std::vector<T> numbersIn(const std::string& text, double least) {
  std::vector<T> numbers;
  for (const std::string& part : split(text))
    numbers.push_back(static_cast<T>(numberIn(part, least)));
  return numbers;
}

using Setters = std::map<std::string, std::function<void(const std::string&)>>;

Setters setters(Options& o) {
  return {
      {"--scenes", [&](const std::string& v) { o.scenes = split(v); }},
      {"--peers", [&](const std::string& v) { o.peers = split(v); }},
      {"--sizes", [&](const std::string& v) { o.sizes = numbersIn<std::size_t>(v, 1); }},
      {"--threads", [&](const std::string& v) { o.threads = numbersIn<int>(v, 0); }},
      {"--devices", [&](const std::string& v) { o.devices = static_cast<int>(numberIn(v, 0)); }},
      {"--moving", [&](const std::string& v) { o.moving = numberIn(v, 0); }},
      {"--batch", [&](const std::string& v) { o.batch = static_cast<int>(numberIn(v, 0)); }},
      {"--budget", [&](const std::string& v) { o.budget = numberIn(v, 0); }},
      {"--limit", [&](const std::string& v) { o.limit = numberIn(v, 0); }},
      {"--rounds", [&](const std::string& v) { o.rounds = static_cast<int>(numberIn(v, 1)); }},
      {"--seed",
       [&](const std::string& v) { o.seed = static_cast<std::uint64_t>(numberIn(v, 0)); }},
      {"--csv", [&](const std::string& v) { o.csv = v; }},
      {"--piles", [&](const std::string& v) { o.piles = v; }},
      {"--trace", [&](const std::string& v) { o.trace = v; }},
  };
}

bool setSwitch(Options& o, const std::string& name) {
  if (name == "--still")
    o.still = true;
  else if (name == "--append")
    o.append = true;
  else if (name == "--list")
    o.list = true;
  else if (name == "--quick")
    o.budget = 0.1, o.rounds = 1;
  else
    return false;
  return true;
}

// False for a flag of Google Benchmark.
bool parse(Options& o, const std::string& argument) {
  const std::size_t equals = argument.find('=');
  const std::string name = argument.substr(0, equals);
  const Setters all = setters(o);
  const auto setter = all.find(name);
  if (setter != all.end() && equals != std::string::npos) {
    setter->second(argument.substr(equals + 1));
    return true;
  }
  return setSwitch(o, argument);
}

}  // namespace

Options& options() {
  static Options options;
  return options;
}

void parseOptions(int& argc, char** argv) {
  const std::string program = argv[0];
  const std::size_t slash = program.rfind('/');
  options().piles = slash == std::string::npos ? "." : program.substr(0, slash);
  int kept = 1;
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--help")) {
      std::fputs(usage, stdout);
      std::exit(0);
    }
    try {
      if (!parse(options(), argv[i])) argv[kept++] = argv[i];
    } catch (const std::invalid_argument&) {
      std::fprintf(stderr, "pair-benchmark: %s: no such number\n", argv[i]);
      std::exit(2);
    }
  }
  argc = kept;
  argv[argc] = nullptr;
}

}  // namespace bench
