#include "options_table.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>

namespace trace {

namespace {

using Clock = std::chrono::steady_clock;

enum class Work { pairs, loop, contacts };  // are counted; dCollide for each; on all threads

// A row to be: how its space is made, and what is set before each frame.
struct Option {
  std::string name;
  int threads = 1;
  Work work = Work::pairs;
  std::function<void(dSpaceID)> change = [](dSpaceID) {};
  std::function<dSpaceID()> create = [] { return dParallelSAPSpaceCreate(nullptr); };
};

struct Counts {
  int most_contacts = 0;
  std::size_t pairs = 0, contacts = 0;
  std::vector<dContactGeom> found{};
};

void countPair(void* counts, dGeomID, dGeomID) {
  ++static_cast<Counts*>(counts)->pairs;
}

void collidePair(void* data, dGeomID a, dGeomID b) {
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) return dSpaceCollide2(a, b, data, collidePair);
  Counts& counts = *static_cast<Counts*>(data);
  ++counts.pairs;
  counts.contacts += static_cast<std::size_t>(
      dCollide(a, b, counts.most_contacts, counts.found.data(), sizeof(dContactGeom)));
}

void takeContacts(void* data, dGeomID, dGeomID, const dContactGeom*, int count) {
  static_cast<Counts*>(data)->contacts += static_cast<std::size_t>(count);
}

void collideOnce(dSpaceID space, const Option& option, Counts& counts) {
  if (option.work == Work::contacts) {
    dParallelSAPContactCallbacks callbacks = {};
    callbacks.contacts = takeContacts;
    dParallelSAPSpaceCollideContacts(space, &counts, counts.most_contacts, &callbacks);
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(space, &stats);
    counts.pairs += stats.pairs;
  } else {
    dSpaceCollide(space, &counts, option.work == Work::loop ? collidePair : countPair);
  }
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Plays the trace. The first frame of each turn, in which all is new, does not count.
TableRow measure(const Recording& recording, const TableWishes& wishes, const Option& option) {
  const dSpaceID space = option.create();
  std::vector<double> times;
  Counts counts = {wishes.contacts, 0, 0, {}};
  counts.found.resize(static_cast<std::size_t>(wishes.contacts));
  try {
    Player player(recording, space);
    const std::size_t frames = recording.frames.size();
    for (std::size_t i = 0; i < frames * static_cast<std::size_t>(wishes.turns); ++i) {
      const Frame& frame = player.advance();
      if (dSpaceIsParallelSAP(space)) {
        setAsTraced(space, frame);
        dParallelSAPSpaceSetNumThreads(space, option.threads);
        option.change(space);
      }
      const Counts before = {0, counts.pairs, counts.contacts, {}};
      const Clock::time_point begin = Clock::now();
      collideOnce(space, option, counts);
      const std::chrono::duration<double, std::milli> ms = Clock::now() - begin;
      if (player.place() > 0 || frames == 1) {
        times.push_back(ms.count());
      } else {
        counts.pairs = before.pairs;
        counts.contacts = before.contacts;
      }
    }
  } catch (...) {
    dSpaceDestroy(space);
    throw;
  }
  dSpaceDestroy(space);
  const auto each = [&](std::size_t all) {
    return static_cast<double>(all) / static_cast<double>(times.size());
  };
  return {option.name,
          option.threads,
          median(times),
          *std::min_element(times.begin(), times.end()),
          each(counts.pairs),
          each(counts.contacts),
          option.work != Work::pairs};
}

Option with(const char* name, int threads, void (*set)(dSpaceID, int)) {
  Option option;
  option.name = name;
  option.threads = threads;
  option.change = [set](dSpaceID space) { set(space, 1); };
  return option;
}

// The options that change which pairs are found, on as many threads as pay.
void addRules(std::vector<Option>& options, const TableWishes& wishes, int threads) {
  options.push_back(with("pairs of static geoms skipped", threads, dParallelSAPSpaceSetSkipStatic));
  options.push_back(with("pairs asleep skipped", threads, dParallelSAPSpaceSetSkipAsleep));
  options.push_back(with("planes culled", threads, dParallelSAPSpaceSetCullPlanes));
  for (const double tolerance : wishes.tolerances) {
    Option option;
    char name[64];
    std::snprintf(name, sizeof name, "tolerance %g", tolerance);
    option.name = name;
    option.threads = threads;
    option.change = [tolerance](dSpaceID space) {
      dParallelSAPSpaceSetTolerance(space, static_cast<dReal>(tolerance));
    };
    options.push_back(option);
  }
}

void addDevices(std::vector<Option>& options, const TableWishes& wishes) {
  for (const int devices : wishes.devices) {
    Option option;
    option.name = std::to_string(devices) + " GPUs";
    option.threads = 0;
    option.change = [devices](dSpaceID space) {
      dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCUDA);
      dParallelSAPSpaceSetNumDevices(space, devices);
    };
    const dSpaceID probe = dParallelSAPSpaceCreate(nullptr);
    if (dParallelSAPSpaceSetBackend(probe, dParallelSAPBackendCUDA)) options.push_back(option);
    dSpaceDestroy(probe);
  }
}

void addSpaces(std::vector<Option>& options, const TableWishes& wishes) {
  for (const std::string& name : wishes.spaces) {
    Option option;
    option.name = "ODE's " + name + " space";
    option.create = [name] {
      if (name == "hash") return dHashSpaceCreate(nullptr);
      if (name == "sap") return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XZY);
      return dSimpleSpaceCreate(nullptr);
    };
    options.push_back(option);
  }
}

std::vector<Option> optionsFor(const TableWishes& wishes) {
  std::vector<Option> options;
  const auto addThreads = [&](Work work, const char* name) {
    for (const int threads : wishes.threads) {
      Option option;
      option.name = name;
      option.threads = threads;
      option.work = work;
      options.push_back(option);
    }
  };
  addThreads(Work::pairs, "as traced");
  addRules(options, wishes, wishes.threads.front());
  addDevices(options, wishes);
  addSpaces(options, wishes);
  if (!wishes.collide) return options;
  Option loop;
  loop.name = "dCollide in the callback";
  loop.work = Work::loop;
  options.push_back(loop);
  addThreads(Work::contacts, "parallel contacts");
  return options;
}

}  // namespace

void setAsTraced(dSpaceID space, const Frame& frame) {
  const auto has = [&](format::Rules rule) { return (frame.rules & rule) != 0; };
  dParallelSAPSpaceSetSkipStatic(space, has(format::skip_static));
  dParallelSAPSpaceSetSkipAsleep(space, has(format::skip_asleep));
  dParallelSAPSpaceSetCullPlanes(space, has(format::cull_planes));
  const double tolerance = frame.tolerance >= 0 && frame.tolerance <= 1e30 ? frame.tolerance : 0;
  dParallelSAPSpaceSetTolerance(space, static_cast<dReal>(tolerance));
}

std::vector<TableRow> measureOptions(const Recording& recording, const TableWishes& wishes) {
  std::vector<TableRow> rows;
  for (const Option& option : optionsFor(wishes))
    rows.push_back(measure(recording, wishes, option));
  return rows;
}

}  // namespace trace
