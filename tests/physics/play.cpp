#include "extreme.h"

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
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
  double microseconds;
};

// Of the process that plays.
Report* report;

// No destructors: a space that is still locked would abort in its own.
[[noreturn]] void answer(const char* outcome) {
  std::strncpy(report->outcome, outcome, sizeof report->outcome - 1);
  _exit(0);
}

void answerAborted(int, const char*, va_list) {
  answer("aborts");
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
    const std::clock_t before = std::clock();
    stage.step();
    report->microseconds += 1e6 * double(std::clock() - before) / CLOCKS_PER_SEC / extreme.steps;
    report->digest = tradeoff::digestOf(stage.bodies(), report->digest);
    report->steps = step + 1;
    if (!stage.isFinite()) return "not finite";
    observer.look(stage, step);
  }
  report->measures = observer.end(stage);
  return judge(extreme, report->measures);
}

[[noreturn]] void playHere(Extreme extreme, Pairing pairing, const Setting& setting,
                           double length) {
  alarm(2000);  // far beyond what it may take
  dSetDebugHandler(answerAborted);
  dSetErrorHandler(answerAborted);
  dSetMessageHandler([](int, const char*, va_list) {});
  const FloatingPointMode mode(extreme.mode);
  extreme.steps = std::max(1, static_cast<int>(extreme.steps * length));
  answer(playOnce(extreme, pairing, setting).c_str());
}

}  // namespace

Result play(const Extreme& extreme, Pairing pairing, const Setting& setting, double length) {
  void* const shared =
      mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) throw std::runtime_error("no memory to share");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    report = static_cast<Report*>(shared);
    playHere(extreme, pairing, setting, length);
  }
  waitpid(child, nullptr, 0);
  const Report said = *static_cast<Report*>(shared);
  munmap(shared, sizeof(Report));
  if (said.outcome[0] == 0) return {"crashes", {}, 0, 0, 0};
  return {said.outcome, said.measures, said.digest, said.steps, said.microseconds};
}

bool same(const Result& a, const Result& b) {
  return a.outcome == b.outcome && a.steps == b.steps && a.digest == b.digest;
}

int startsHeld(const Extreme& extreme, const Setting& setting) {
  int held = 0;
  for (unsigned start = 0; start < kStarts; ++start) {
    Setting other = setting;
    other.start = start;
    held += isWhatItOwes(play(extreme, Pairing::ours, other).outcome);
  }
  return held;
}

}  // namespace sap_test::physics
