#include "replay_timing.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

namespace trace {

namespace {

using Clock = std::chrono::steady_clock;

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

dSpaceID createSpace(const Setting& setting) {
  if (setting.space == "hash") return dHashSpaceCreate(nullptr);
  if (setting.space == "sap") return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XZY);
  if (setting.space == "simple") return dSimpleSpaceCreate(nullptr);
  return dParallelSAPSpaceCreate(nullptr);
}

void apply(dSpaceID space, const Setting& setting, const Frame& frame) {
  if (!dSpaceIsParallelSAP(space)) return;
  setAsTraced(space, frame);
  dParallelSAPSpaceSetNumThreads(space, setting.threads);
  const int backend = setting.devices > 0 ? dParallelSAPBackendCUDA : dParallelSAPBackendCPU;
  if (!dParallelSAPSpaceSetBackend(space, backend))
    throw std::runtime_error("--devices: there is no GPU here");
  dParallelSAPSpaceSetNumDevices(space, setting.devices);
  if (setting.skip_static) dParallelSAPSpaceSetSkipStatic(space, 1);
  if (setting.skip_asleep) dParallelSAPSpaceSetSkipAsleep(space, 1);
  if (setting.cull_planes) dParallelSAPSpaceSetCullPlanes(space, 1);
  if (setting.tolerance > 0)
    dParallelSAPSpaceSetTolerance(space, static_cast<dReal>(setting.tolerance));
}

void collideOnce(dSpaceID space, Work work, Counts& counts) {
  if (work != Work::contacts)
    return dSpaceCollide(space, &counts, work == Work::loop ? collidePair : countPair);
  dParallelSAPContactCallbacks callbacks = {};
  callbacks.contacts = takeContacts;
  dParallelSAPSpaceCollideContacts(space, &counts, counts.most_contacts, &callbacks);
  dParallelSAPStats stats;
  dParallelSAPSpaceGetStats(space, &stats);
  counts.pairs += stats.pairs;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Timing play(const Recording& recording, const Setting& setting, dSpaceID space) {
  Player player(recording, space);
  Counts all = {setting.contacts, 0, 0, {}};
  all.found.resize(static_cast<std::size_t>(std::max(1, setting.contacts)));
  std::vector<double> times;
  const std::size_t frames = recording.frames.size();
  for (std::size_t i = 0; i < frames * static_cast<std::size_t>(setting.turns); ++i) {
    apply(space, setting, player.advance());
    const std::size_t pairs = all.pairs, contacts = all.contacts;
    const Clock::time_point begin = Clock::now();
    collideOnce(space, setting.work, all);
    const std::chrono::duration<double, std::milli> ms = Clock::now() - begin;
    if (player.place() > 0 || frames == 1) {
      times.push_back(ms.count());
    } else {
      all.pairs = pairs;
      all.contacts = contacts;
    }
  }
  const double count = static_cast<double>(times.size());
  return {median(times), *std::min_element(times.begin(), times.end()),
          static_cast<double>(all.pairs) / count, static_cast<double>(all.contacts) / count};
}

}  // namespace

Timing measure(const Recording& recording, const Setting& setting) {
  const dSpaceID space = createSpace(setting);
  try {
    const Timing timing = play(recording, setting, space);
    dSpaceDestroy(space);
    return timing;
  } catch (...) {
    dSpaceDestroy(space);
    throw;
  }
}

}  // namespace trace
