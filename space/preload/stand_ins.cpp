// What the preload library uses: spaces in the place of stock ones, and an account of them.
#include "space/preload/stand_ins.h"

#include <algorithm>
#include <climits>
#include <cmath>
#include <cstdio>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <tuple>
#include <typeinfo>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "space/contacts/collider_threads.h"
#include "space/facts/facts.h"
#include "space/frame/statistics.h"
#include "space/ode/environment.h"
#include "space/ode/ode_space.h"
#include "space/preload/ode_layout.h"
#include "space/preload/precomputed_contacts.h"
#include "space/trace/trace.h"

namespace ode_parallel_sap {

namespace {

class StandIn;

// The sums over spaces that are gone, and those that are not.
struct Account {
  std::mutex mutex;
  std::unordered_set<const StandIn*> alive;
  FrameSums frames;
  Facts facts;
  PrecomputedContacts::Counts precomputed;
};

// Never destroyed: spaces may outlive everything.
Account& account() {
  static Account& the_account = *new Account;
  return the_account;
}

class StandIn final : public ParallelSAPSpace {
 public:
  // One account for all of them prints the sums.
  StandIn(dSpaceID parent, int space_class) : ParallelSAPSpace(parent, space_class) {
    stock_first_ = nameFromEnvironment("ODE_PARALLEL_SAP_FIRST", {"added", "stock"}, 0) == 1 &&
                   (space_class == dSimpleSpaceClass || space_class == dHashSpaceClass);
    const int mode = nameFromEnvironment("ODE_PARALLEL_SAP_CONTACTS", {"auto", "off", "on"}, 0);
    if (mode != 1) {
      auto contacts = std::make_unique<PrecomputedContacts>(mode == 2);
      precomputed_ = contacts.get();
      pipeline().last_stage = std::move(contacts);
    }
    settings().rules.notified =
        nameFromEnvironment("ODE_PARALLEL_SAP_NOTIFIED", notified_modes, 1) != 0;
    SpaceObservers& observers = pipeline().observers;
    if (auto trace = Trace::fromEnvironment()) observers.add(std::move(trace));
    if (!settings().print_stats) return;
    observers.add(std::make_unique<Facts>());
    facts_ = observers.find<Facts>();
    const std::lock_guard<std::mutex> lock(account().mutex);
    account().alive.insert(this);
  }

  ~StandIn() {
    if (!facts_) return;
    const std::lock_guard<std::mutex> lock(account().mutex);
    account().alive.erase(this);
    addTo(account());
  }

  // Locked spaces call it again for what is dirty already.
  void dirty(dxGeom* geom) override {
    ParallelSAPSpace::dirty(geom);
    try {
      if (stock_first_ && !lock_count) moved_[geom] = ++moves_;
    } catch (const std::bad_alloc&) {  // then it comes last
    }
  }
  void collide(void* data, dNearCallback* callback) override {
    if (!stock_first_) return ParallelSAPSpace::collide(data, callback);
    using Call = std::tuple<const StandIn*, void*, dNearCallback*>;
    Call call(this, data, callback);
    ParallelSAPSpace::collide(&call, [](void* passed, dGeomID a, dGeomID b) {
      const auto& [space, to, report] = *static_cast<Call*>(passed);
      if (space->placeInStock(b) < space->placeInStock(a)) std::swap(a, b);
      report(to, a, b);
    });
  }

  void addTo(Account& sums) const {
    sums.frames.add(pipeline().statistics.sums());
    sums.facts.add(*facts_);
    if (precomputed_) sums.precomputed.add(precomputed_->counts());
  }

 private:
  // dHashSpace passes the geom with the smaller cells first. If they are equal, and always in
  // dSimpleSpace, the geom that moved last comes first.
  std::pair<int, long long> placeInStock(const dxGeom* geom) const {
    int level = 0;
    if (type == dHashSpaceClass) {
      const dReal* const b = geom->aabb;
      const dReal size = std::max({b[1] - b[0], b[3] - b[2], b[5] - b[4]});
      std::frexp(size, &level);
      const auto& [least, most] = hash_levels_;
      level = size < dInfinity && level <= most ? std::max(level, least) : INT_MAX;
    }
    const auto moved = moved_.find(geom);
    return {level, moved == moved_.end() ? 0 : -moved->second};
  }

  bool stock_first_;
  long long moves_ = 0;
  std::unordered_map<const dxGeom*, long long> moved_;  // the last moves, if stock_first_
  const Facts* facts_ = nullptr;                        // where they are counted
  const PrecomputedContacts* precomputed_ = nullptr;    // the space's
};

void report() {
  Account& sums = account();
  const std::lock_guard<std::mutex> lock(sums.mutex);
  for (const StandIn* const space : sums.alive) space->addTo(sums);
  sums.alive.clear();
  const auto print = [](const std::string& line) {
    std::fprintf(stderr, "ode-parallel-sap: %s\n", line.c_str());
  };
  for (const std::string& line : sums.frames.lines()) print(line);
  std::fprintf(stderr,
               "ode-parallel-sap: %llu pairs collided before dCollide was called for them: %llu of "
               "them were asked for, with %llu contacts\n",
               sums.precomputed.precomputed, sums.precomputed.used, sums.precomputed.contacts);
  for (const std::string& line : sums.facts.lines(sums.frames.average())) print(line);
}

void noteChange(dxGeom* geom, dBodyID body) {
  if (!geom && !body) return ParallelSAPSpace::notifyAll();
  if (body)
    for (dxGeom* own = dBodyGetFirstGeom(body); own; own = dBodyGetNextGeom(own))
      noteChange(own, nullptr);
  dxSpace* const space = geom ? geom->parent_space : nullptr;
  if (space && typeid(*space) == typeid(StandIn))
    static_cast<StandIn*>(space)->pipeline().notify(geom);
}

}  // namespace

}  // namespace ode_parallel_sap

const dParallelSAPStandIns* dParallelSAPGetStandIns(void) {
  using namespace ode_parallel_sap;
  static const dParallelSAPStandIns stand_ins = {
      [] {
        ParallelSAPSpace space(nullptr, dHashSpaceClass);
        const char* const misfit = misfitOfODE(&space);
        int least = 0, most = 0;
        if (!misfit) dHashSpaceGetLevels(&space, &least, &most);
        return misfit || (least == -3 && most == 10) ? misfit : "the levels of a hash space";
      },
      [](dSpaceID parent, int space_class) -> dSpaceID { return new StandIn(parent, space_class); },
      report,
      [](auto* collide) { ode_collide.store(collide, std::memory_order_relaxed); },
      PrecomputedContacts::answer,
      noteChange,
      PrecomputedContacts::stop};
  return &stand_ins;
}
