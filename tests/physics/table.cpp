// What becomes of every extreme, with whose pairs, and what would rescue it:
//
//     physics-table measure ROWS.csv [seconds [part of a name [seconds of a rescue]]]
//
// Plays all of them, or those of such names, in the precision of the ODE that it is built
// with, on all cores, and adds a row to the file as soon as it has one. What has a row already is
// not played again, but for a rescue that was not looked for. With 0 seconds of the processor for a
// rescue none is. Where the seconds are up before it has all rows it ends with 75, to be called
// again; with 1 if an outcome of dParallelSAPSpace is not, bit for bit, that of dSimpleSpace's
// pairs in the same order.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <iostream>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>

#include "rows.h"

namespace sap_test {
namespace physics {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kTimeIsUp = 75;

// What one call does.
struct Job {
  std::string file;
  Clock::time_point until = Clock::time_point::max();
  std::string part;           // of the names
  double rescue_seconds = 3;  // stacks of 100 at 20 iterations take 0.2

  bool timeIsUp() const { return Clock::now() >= until; }
};

bool lacksRescue(const Job& job, const Row& row) {
  return row.rescue == kNotLookedFor && job.rescue_seconds > 0;
}

// False where the time was up before.
bool addRescue(const Job& job, const Extreme& extreme, Row& row) {
  Limits limits;
  limits.seconds = job.rescue_seconds;
  const Rescue found = rescue(extreme, limits, [&job] { return job.timeIsUp(); });
  row.rescue = found.name.empty() ? kNone : found.name;
  row.cost = found.cost;
  return found.looked_everywhere;
}

// Likewise. `row` is what there is of it.
bool complete(const Job& job, const Extreme& extreme, Row& row) {
  if (row.extreme.empty()) {
    const Setting as_it_comes;
    const Limits limits;
    const Result simple = play(extreme, Pairing::simple_in_our_order, as_it_comes, limits);
    const Result hash = play(extreme, Pairing::hash, as_it_comes, limits);
    const Result ours = play(extreme, Pairing::ours, as_it_comes, limits);
    row = {extreme.theme,
           extreme.name,
           shown(simple),
           shown(hash),
           shown(ours),
           same(ours, simple),
           ours.measures,
           isWhatItOwes(ours.outcome) ? "" : kNotLookedFor,
           0};
  }
  return !lacksRescue(job, row) || addRescue(job, extreme, row);
}

void tell(const Row& row) {
  std::ostringstream line;
  line << row.theme << ": " << row.extreme << ": " << row.simple << ", " << row.hash << ", "
       << row.ours << (row.same ? "" : ", NOT THE SAME") << "; " << row.rescue << "\n";
  std::cerr << line.str() << std::flush;
}

struct Task {
  const Extreme* extreme;
  Row row;  // empty, or without a rescue
};

// What is to be done, what has most steps first.
std::vector<Task> tasksOf(const Job& job, const std::vector<Row>& rows) {
  std::vector<Task> tasks;
  for (const Extreme& extreme : extremes()) {
    if (extreme.name.find(job.part) == std::string::npos) continue;
    const auto known = std::find_if(rows.begin(), rows.end(), [&extreme](const Row& row) {
      return row.extreme == extreme.name;
    });
    if (known == rows.end()) {
      tasks.push_back({&extreme, {}});
    } else if (lacksRescue(job, *known)) {
      tasks.push_back({&extreme, *known});
    }
  }
  std::stable_sort(tasks.begin(), tasks.end(), [](const Task& a, const Task& b) {
    return a.extreme->steps > b.extreme->steps;
  });
  return tasks;
}

// A thread a core, each of which takes the next one until there is none or the time is up. Returns
// how many got their row.
std::size_t workOff(const Job& job, std::vector<Task>& tasks) {
  std::atomic<std::size_t> next{0}, done{0};
  std::mutex file;
  const auto work = [&] {
    dAllocateODEDataForThread(dAllocateMaskAll);
    for (std::size_t i; !job.timeIsUp() && (i = next++) < tasks.size();) {
      if (!complete(job, *tasks[i].extreme, tasks[i].row)) continue;
      const std::lock_guard<std::mutex> lock(file);
      addRow(job.file, tasks[i].row);
      tell(tasks[i].row);
      ++done;
    }
    dCleanupODEAllDataForThread();
  };
  std::vector<std::thread> threads;
  for (unsigned i = std::max(1u, std::thread::hardware_concurrency()); i > 0; --i) {
    threads.emplace_back(work);
  }
  for (std::thread& thread : threads) thread.join();
  return done;
}

// Of an extreme that has two the later one.
std::vector<Row> lastOfEach(const std::vector<Row>& rows) {
  std::vector<Row> last;
  for (const Row& row : rows) {
    const auto known = std::find_if(last.begin(), last.end(), [&row](const Row& other) {
      return other.extreme == row.extreme;
    });
    known == last.end() ? last.push_back(row) : void(*known = row);
  }
  return last;
}

int measure(const Job& job) {
  const std::vector<Row> before = lastOfEach(readRows(job.file));
  std::vector<Task> tasks = tasksOf(job, before);
  if (!before.empty()) writeRows(job.file, before);
  const std::size_t done = workOff(job, tasks);
  const std::vector<Row> rows = lastOfEach(readRows(job.file));
  writeRows(job.file, rows);
  std::cerr << done << " of " << tasks.size() << " rows\n";
  if (done < tasks.size()) return kTimeIsUp;
  return std::all_of(rows.begin(), rows.end(), [](const Row& row) { return row.same; }) ? 0 : 1;
}

int run(const std::vector<std::string>& words) {
  if (words.size() < 2 || words.size() > 5 || words[0] != "measure") {
    throw std::runtime_error("measure ROWS.csv [seconds [part [seconds of a rescue]]]");
  }
  Job job;
  job.file = words[1];
  if (words.size() > 2) {
    job.until = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                   std::chrono::duration<double>(std::stod(words[2])));
  }
  if (words.size() > 3) job.part = words[3];
  if (words.size() > 4) job.rescue_seconds = std::stod(words[4]);
  return measure(job);
}

}  // namespace
}  // namespace physics
}  // namespace sap_test

int main(int argc, char** argv) try {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  return sap_test::physics::run({argv + 1, argv + argc});
} catch (const std::exception& problem) {
  std::cerr << argv[0] << ": " << problem.what() << "\n";
  return 2;
}
