// What the preload library uses: spaces in the place of stock ones, and an account of them.
#include "preload/stand_ins.h"

#include <chrono>
#include <cstdio>
#include <mutex>
#include <unordered_set>

#include "ode_layout.h"
#include "parallel_sap_space.h"

namespace ode_parallel_sap {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

class StandIn;

// The sums over spaces that are gone, and those that are not.
struct Account {
  std::mutex mutex;
  const Clock::time_point begin = Clock::now();
  std::unordered_set<const StandIn*> alive;
  dParallelSAPStats sums = {};
  unsigned long long collide2_calls = 0;
  double collide2_s = 0;
};

// Never destroyed: spaces may outlive everything.
Account& account() {
  static Account& the_account = *new Account;
  return the_account;
}

class StandIn final : public ParallelSAPSpace {
 public:
  StandIn(dSpaceID parent, int space_class) : ParallelSAPSpace(parent, space_class) {
    counted_ = settings.print_stats;
    settings.print_stats = false;  // one account for all of them
    if (!counted_) return;
    const std::lock_guard<std::mutex> lock(account().mutex);
    account().alive.insert(this);
  }

  ~StandIn() {
    if (!counted_) return;
    const std::lock_guard<std::mutex> lock(account().mutex);
    account().alive.erase(this);
    addTo(account());
  }

  void collide2(void* data, dxGeom* geom, dNearCallback* callback) override {
    if (!counted_) return ParallelSAPSpace::collide2(data, geom, callback);
    const Clock::time_point begin = Clock::now();
    ParallelSAPSpace::collide2(data, geom, callback);
    ++collide2_calls_;
    collide2_s_ += secondsSince(begin);
  }

  void addTo(Account& sums) const {
    sums.sums.frames += totals().frames;
    sums.sums.geoms += totals().geoms;
    sums.sums.pairs += totals().pairs;
    sums.sums.update_ms += totals().update_ms;
    sums.sums.synchronise_ms += totals().synchronise_ms;
    sums.sums.extract_ms += totals().extract_ms;
    sums.sums.filter_ms += totals().filter_ms;
    sums.sums.report_ms += totals().report_ms;
    sums.sums.total_ms += totals().total_ms;
    sums.collide2_calls += collide2_calls_;
    sums.collide2_s += collide2_s_;
  }

  int minlevel = -3, maxlevel = 10;  // what dHashSpace begins with

 private:
  bool counted_;
  unsigned long long collide2_calls_ = 0;
  double collide2_s_ = 0;
};

dSpaceID create(dSpaceID parent, int space_class) {
  return new StandIn(parent, space_class);
}

int setLevels(dSpaceID space, int minlevel, int maxlevel) {
  StandIn* const own = dynamic_cast<StandIn*>(space);
  if (!own) return 0;
  dUASSERT(own->type == dHashSpaceClass, "argument must be a hash space");
  dUASSERT(minlevel <= maxlevel, "must have minlevel <= maxlevel");
  own->minlevel = minlevel;
  own->maxlevel = maxlevel;
  return 1;
}

int getLevels(dSpaceID space, int* minlevel, int* maxlevel) {
  const StandIn* const own = dynamic_cast<StandIn*>(space);
  if (!own) return 0;
  dUASSERT(own->type == dHashSpaceClass, "argument must be a hash space");
  if (minlevel) *minlevel = own->minlevel;
  if (maxlevel) *maxlevel = own->maxlevel;
  return 1;
}

void report() {
  Account& sums = account();
  const std::lock_guard<std::mutex> lock(sums.mutex);
  for (const StandIn* const space : sums.alive) space->addTo(sums);
  sums.alive.clear();
  const dParallelSAPStats& all = sums.sums;
  const double frames = all.frames ? static_cast<double>(all.frames) : 1;
  std::fprintf(stderr,
               "ode-parallel-sap: %llu dSpaceCollide of %.0f geoms with %.0f pairs took %.3f ms "
               "each: update %.3f, synchronise %.3f, extract %.3f, filter %.3f, callbacks %.3f\n",
               all.frames, all.geoms / frames, all.pairs / frames, all.total_ms / frames,
               all.update_ms / frames, all.synchronise_ms / frames, all.extract_ms / frames,
               all.filter_ms / frames, all.report_ms / frames);
  std::fprintf(
      stderr,
      "ode-parallel-sap: %.3f s since the first space: finding pairs %.3f, callbacks %.3f, "
      "%llu dSpaceCollide2 with their callbacks %.3f\n",
      secondsSince(sums.begin), (all.total_ms - all.report_ms) / 1000, all.report_ms / 1000,
      sums.collide2_calls, sums.collide2_s);
}

}  // namespace

}  // namespace ode_parallel_sap

const dParallelSAPStandIns* dParallelSAPGetStandIns(void) {
  using namespace ode_parallel_sap;
  static const dParallelSAPStandIns stand_ins = {misfitOfODE, create, setLevels, getLevels, report};
  return &stand_ins;
}
