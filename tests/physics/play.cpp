#include "extreme.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstring>
#include <ctime>
#include <stdexcept>

namespace sap_test::physics {

namespace {

// What a run's process has to say, in memory that both share.
struct Report {
  char outcome[32];
  Measures measures;
  std::uint64_t digest;
  int steps;
  double seconds;
};

// Of the process that plays.
Report* report;
double begun = 0;
int runs = 0;

double processorSeconds() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

// No destructors: a space that is still locked would abort in its own.
[[noreturn]] void answer(const char* outcome) {
  report->seconds = (processorSeconds() - begun) / std::max(1, runs);
  std::strncpy(report->outcome, outcome, sizeof report->outcome - 1);
  _exit(0);
}

void answerAborted(int, const char*, va_list) {
  answer("aborts");
}

void answerSlow(int) {
  answer("too slow");
}

void limitProcessorTime(double seconds) {
  signal(SIGVTALRM, answerSlow);
  itimerval timer = {};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  timer.it_value.tv_usec =
      static_cast<suseconds_t>(std::fmax(1, 1e6 * (seconds - std::floor(seconds))));
  setitimer(ITIMER_VIRTUAL, &timer, nullptr);
}

// One run from the beginning; fills the report.
std::string playOnce(const Extreme& extreme, Pairing pairing, const Setting& setting) {
  report->digest = 0;
  Stage stage(pairing, setting, extreme.step);
  extreme.build(stage);
  stage.stir(1e-5 * extreme.unit);
  Observer observer(extreme, stage);
  for (int step = 0; step < extreme.steps; ++step) {
    extreme.drive(stage, step);
    stage.step();
    report->digest = tradeoff::digestOf(stage.bodies(), report->digest);
    report->steps = step + 1;
    if (!stage.isFinite()) return "not finite";
    observer.look(stage, step);
  }
  report->measures = observer.end(stage);
  return judge(extreme, report->measures);
}

[[noreturn]] void playHere(Extreme extreme, Pairing pairing, const Setting& setting,
                           const Limits& limits) {
  alarm(static_cast<unsigned>(20 * (limits.seconds + 1)));  // far beyond what it may take
  dSetDebugHandler(answerAborted);
  dSetErrorHandler(answerAborted);
  dSetMessageHandler([](int, const char*, va_list) {});
  begun = processorSeconds();
  limitProcessorTime(limits.seconds);
  const FloatingPointMode mode(extreme.mode);
  extreme.steps = std::max(1, static_cast<int>(extreme.steps * limits.length));
  std::string outcome;
  do {
    outcome = playOnce(extreme, pairing, setting);
    ++runs;
  } while (processorSeconds() - begun < limits.at_least);
  answer(outcome.c_str());
}

}  // namespace

Result play(const Extreme& extreme, Pairing pairing, const Setting& setting, const Limits& limits) {
  void* const shared =
      mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) throw std::runtime_error("no memory to share");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    report = static_cast<Report*>(shared);
    playHere(extreme, pairing, setting, limits);
  }
  waitpid(child, nullptr, 0);
  const Report said = *static_cast<Report*>(shared);
  munmap(shared, sizeof(Report));
  if (said.outcome[0] == 0) return {"crashes", {}, 0, 0, 0};
  return {said.outcome, said.measures, said.digest, said.steps, said.seconds};
}

bool same(const Result& a, const Result& b) {
  return a.outcome == b.outcome && a.steps == b.steps && a.digest == b.digest;
}

namespace {

// The settings that differ from ODE's own name it.
Way named(const Setting& setting) {
  Way way{"", setting};
  const auto add = [&way](bool differs, const std::string& words) {
    if (differs) way.name += (way.name.empty() ? "" : ", ") + words;
  };
  const int divide = setting.divide;
  add(setting.erp != 0.2, "ERP " + shortNumber(setting.erp));
  add(setting.exact, "dWorldStep");
  add(setting.cfm != kOdesCfm, setting.cfm == 0 ? "CFM 0" : "CFM 1e-5");
  add(setting.iterations != 20, std::to_string(setting.iterations) + " iterations");
  add(divide > 1, divide == 2 ? "half the step" : "a step of 1/" + std::to_string(divide));
  add(setting.correction > 0, "correcting velocity of " + shortNumber(setting.correction) + " m/s");
  add(setting.damping > 0, "damping of " + shortNumber(setting.damping));
  add(setting.finite_rotation, "finite rotations");
  return way;
}

}  // namespace

const std::vector<Way>& ways() {
  static const std::vector<Way> all = [] {
    std::vector<Way> ways;
    const auto add = [&ways](auto... change) {
      Setting setting;
      (change(setting), ...);
      ways.push_back(named(setting));
    };
    const auto erp = [](double value) { return [=](Setting& s) { s.erp = value; }; };
    const auto cfm = [](double value) { return [=](Setting& s) { s.cfm = value; }; };
    const auto quick = [](int iterations, int divide) {
      return [=](Setting& s) { s.iterations = iterations, s.divide = divide; };
    };
    const auto exact = [](int divide) {
      return [=](Setting& s) { s.exact = true, s.divide = divide; };
    };
    constexpr double soft = 1e-5;
    for (const double value : {0.8, 0.05}) add(erp(value));
    for (const double value : {0.0, soft}) add(cfm(value));
    add(erp(0.8), cfm(soft));
    for (const double speed : {10.0, 1.0, 0.1}) add([=](Setting& s) { s.correction = speed; });
    add([](Setting& s) { s.damping = 0.01; });
    add([](Setting& s) { s.finite_rotation = true; });
    for (const int divide : {1, 2, 4, 10, 100}) {
      for (const int iterations : {20, 50, 100, 300, 1000})
        if ((divide > 1 || iterations > 20) && (divide < 10 || iterations <= 100))
          add(quick(iterations, divide));
      add(exact(divide));
      add(exact(divide), cfm(soft));
    }
    for (const int divide : {1, 4}) add(erp(0.8), quick(100, divide));
    return ways;
  }();
  return all;
}

namespace {

// Short runs are repeated, which takes the clock's ticks of some ms and the start of a process out.
double secondsOf(const Extreme& extreme, const Setting& setting, Limits limits) {
  limits.at_least = 0.1;
  return play(extreme, Pairing::ours, setting, limits).seconds;
}

// Whether it is at least as much work in every way.
bool takesAsLong(const Setting& setting, const Setting& other) {
  return setting.exact == other.exact && setting.divide >= other.divide &&
         (setting.exact || setting.iterations >= other.iterations);
}

}  // namespace

int startsHeld(const Extreme& extreme, const Setting& setting, const Limits& limits,
               bool all_or_none) {
  int held = 0;
  for (unsigned start = 0; start < kStarts; ++start) {
    Setting other = setting;
    other.start = start;
    const bool holds = isWhatItOwes(play(extreme, Pairing::ours, other, limits).outcome);
    held += holds;
    if (!holds && all_or_none) return 0;
  }
  return held;
}

Rescue rescue(const Extreme& extreme, const Limits& limits) {
  Rescue best;
  const double as_it_comes = secondsOf(extreme, {}, limits);
  double least = limits.seconds;
  std::vector<Setting> too_slow;
  for (const Way& way : ways()) {
    if (std::any_of(too_slow.begin(), too_slow.end(),
                    [&way](const Setting& slow) { return takesAsLong(way.setting, slow); })) {
      continue;
    }
    Limits left = limits;
    left.seconds = std::fmin(limits.seconds, 2 * least + 0.1);
    const Result result = play(extreme, Pairing::ours, way.setting, left);
    if (result.outcome == "too slow") too_slow.push_back(way.setting);
    if (!isWhatItOwes(result.outcome)) continue;
    const double seconds = secondsOf(extreme, way.setting, left);
    if (seconds >= least || startsHeld(extreme, way.setting, left, true) < kStarts) continue;
    least = seconds;
    best.name = way.name;
    best.cost = seconds / as_it_comes;
  }
  return best;
}

}  // namespace sap_test::physics
