#include "play.h"

#include <poll.h>
#include <signal.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <type_traits>

namespace sap_test {
namespace physics {

namespace {

// What a run's process has to say, in shape for a pipe.
struct Report {
  char outcome[32];
  Measures measures;
  std::uint64_t digest;
  int steps;
  double seconds;
};
static_assert(std::is_trivially_copyable<Report>::value, "goes through a pipe");

// Each thread plays in a process of its own.
thread_local Report report;
thread_local int answer_to = -1;
// In that process.
double begun = 0;
int runs = 0;

double processorSeconds() {
  timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

// No destructors: a space that is still locked would abort in its own.
[[noreturn]] void answer(const char* outcome) {
  std::strncpy(report.outcome, outcome, sizeof report.outcome - 1);
  report.seconds = (processorSeconds() - begun) / std::max(1, runs);
  const ssize_t written = write(answer_to, &report, sizeof report);
  _exit(written == static_cast<ssize_t>(sizeof report) ? 0 : 1);
}

void answerAborted(int, const char*, va_list) {
  answer("aborts");
}

void answerSlow(int) {
  answer("too slow");
}

void sayNothing(int, const char*, va_list) {}

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
  report.digest = 0;
  Stage stage(pairing, setting, extreme.step);
  extreme.build(stage);
  stage.stir(1e-5 * extreme.unit);
  Observer observer(extreme, stage);
  for (int step = 0; step < extreme.steps; ++step) {
    extreme.drive(stage, step);
    stage.step();
    report.digest = digest(stage, report.digest);
    report.steps = step + 1;
    if (!isFinite(stage)) return "not finite";
    observer.look(stage, step);
  }
  report.measures = observer.end(stage);
  return judge(extreme, report.measures);
}

[[noreturn]] void playHere(Extreme extreme, Pairing pairing, const Setting& setting,
                           const Limits& limits) {
  dSetDebugHandler(answerAborted);
  dSetErrorHandler(answerAborted);
  dSetMessageHandler(sayNothing);
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

// Whether all of the report came, before some time far beyond what it may take.
bool hear(int from, double seconds) {
  report = {};
  std::size_t got = 0;
  while (got < sizeof report) {
    pollfd waiting = {from, POLLIN, 0};
    if (poll(&waiting, 1, static_cast<int>(20000 * (seconds + 1))) <= 0) return false;
    const ssize_t length = read(from, reinterpret_cast<char*>(&report) + got, sizeof report - got);
    if (length <= 0) return false;
    got += static_cast<std::size_t>(length);
  }
  return true;
}

}  // namespace

Result play(const Extreme& extreme, Pairing pairing, const Setting& setting, const Limits& limits) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  report = {};
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    close(ends[0]);
    answer_to = ends[1];
    playHere(extreme, pairing, setting, limits);
  }
  close(ends[1]);
  Result result;
  result.outcome = "crashes";
  if (hear(ends[0], limits.seconds)) {
    result = {report.outcome, report.measures, report.digest, report.steps, report.seconds};
  } else {
    kill(child, SIGKILL);
  }
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return result;
}

bool same(const Result& a, const Result& b) {
  return a.outcome == b.outcome && a.steps == b.steps && a.digest == b.digest;
}

}  // namespace physics
}  // namespace sap_test
