// Scenes in which geoms come, go and change, whose events an oracle follows.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <iterator>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "configurations.h"
#include "events_oracle.h"
#include "oracle.h"
#include "random.h"
#include "recorder.h"

namespace sap_test {

struct Stop : std::runtime_error {
  Stop() : std::runtime_error("stop") {}
};

// A space whose geoms come, go and change, and the frames in which it is told. What ODE does not
// tell it, the scene does.
class EventsScene {
 public:
  EventsScene(const Configuration& configuration, std::size_t geoms, std::uint64_t seed)
      : random_(seed), space_(configuration), most_(geoms + geoms / 2) {
    dParallelSAPSpaceSetEvents(space_, 1);
    dParallelSAPSpaceSetNotified(space_, random_.chance(0.5));
    side_ = std::cbrt(static_cast<double>(geoms)) * 1.2;
    for (std::size_t i = 0; i < geoms; ++i) create();
  }
  ~EventsScene() {
    for (const dGeomID geom : outside_) dGeomDestroy(geom);
  }

  // Some edits, often none.
  void edit() {
    const std::size_t kind = random_.below(12);
    const std::size_t count = random_.chance(0.7) ? 1 + random_.below(5) : in_.size() / 3;
    log_ = "edit " + std::to_string(kind) + " of " + std::to_string(count);
    for (std::size_t i = 0; i < count && kind < 9; ++i) {
      if (kind < 3 && !in_.empty()) place(any());
      if (kind == 3 || kind == 8) create();
      if (kind == 4 || kind == 8) destroy();
      if (kind == 5) remove();
      if (kind == 6 && !outside_.empty()) addAgain();
      if (kind == 7 && !in_.empty()) enable(any(), random_.chance(0.5));
    }
    if (kind == 9) settle();
    // The last ones make room for others that get their slots.
    if (kind == 10)
      for (std::size_t i = 0; i < count && !in_.empty(); ++i) {
        destroyIt(std::prev(in_.end()));
        if (random_.chance(0.7)) create();
      }
  }

  // A frame of one of the kinds that there are; returns what is wrong of it.
  std::string collideAndCheck() {
    Pairs pairs;
    const std::size_t kind = random_.below(8);
    log_ += ", collide " + std::to_string(kind);
    if (kind == 0) {
      collideThrowing();
      pairs = expected();
    } else if (kind == 1) {
      pairs = collideWithin();
    } else if (kind == 2) {
      pairs = pairsOfContacts();
    } else if (kind == 3) {
      dParallelSAPSpaceCollidePairs(
          space_, &pairs, 0,
          [](void* all, const dParallelSAPPair* some, std::size_t count, std::size_t) {
            for (std::size_t i = 0; i < count; ++i) record(all, some[i].o1, some[i].o2);
          });
    } else if (kind == 4) {
      for (std::size_t again = random_.below(4); again > 0; --again) {
        dParallelSAPSpaceCollidePairs(space_, nullptr, 0, nullptr);
        const std::string problem = oracle.check(space_, expected(), in_);
        if (problem != "") return problem;
      }
      dParallelSAPSpaceCollidePairs(space_, nullptr, 0, nullptr);
      pairs = expected();
    } else {
      pairs = collide(space_);
    }
    return oracle.check(space_, pairs, in_);
  }

  dSpaceID space() const { return space_; }
  const std::string& log() const { return log_; }
  std::size_t size() const { return in_.size(); }
  EventsOracle oracle;

 private:
  dGeomID any() {
    auto at = in_.lower_bound(random_.below(next_));
    return at == in_.end() ? in_.begin()->second : at->second;
  }
  void enable(dGeomID geom, bool on) { enable(space_, geom, on); }
  static void enable(dSpaceID space, dGeomID geom, bool on) {
    (on ? dGeomEnable : dGeomDisable)(geom);
    dParallelSAPSpaceNotify(space, geom);
  }
  void place(dGeomID geom) { dGeomSetPosition(geom, coordinate(), coordinate(), coordinate()); }
  dReal coordinate() { return static_cast<dReal>(random_.between(0, side_)); }
  void create() {
    if (in_.size() >= most_) return;
    const dGeomID geom =
        random_.chance(0.9) ? dCreateBox(nullptr, 1, 1, 1) : dCreateSphere(nullptr, dReal(0.7));
    place(geom);
    add(geom);
  }
  void add(dGeomID geom) {
    setNumber(geom, next_);
    dSpaceAdd(space_, geom);
    in_[next_++] = geom;
  }
  void destroyIt(std::map<std::size_t, dGeomID>::iterator it) {
    dGeomDestroy(it->second);
    in_.erase(it);
  }
  void destroy() {
    if (in_.size() < 3) return;
    const auto at = in_.lower_bound(random_.below(next_));
    destroyIt(at == in_.end() ? in_.begin() : at);
  }
  void remove() {
    if (in_.size() < 3) return;
    const dGeomID geom = any();
    in_.erase(number(geom));
    dSpaceRemove(space_, geom);
    if (random_.chance(0.3))
      add(geom);
    else
      outside_.push_back(geom);
  }
  void addAgain() {
    add(outside_.back());
    outside_.pop_back();
  }
  // Other ways to find the same pairs, and rules by which there are others.
  void settle() {
    const int threads[] = {1, 2, 3, 7};
    dParallelSAPSpaceSetNumThreads(space_, threads[random_.below(4)]);
    dParallelSAPSpaceSetSkipStatic(space_, random_.chance(0.1));
    dParallelSAPSpaceSetMethod(space_, static_cast<int>(random_.below(3)));
    dParallelSAPSpaceSetNotified(space_, random_.chance(0.5));
  }
  Pairs expected() const {
    std::vector<dGeomID> geoms;
    if (!dParallelSAPSpaceGetSkipStatic(space_))
      for (const auto& [number, geom] : in_) geoms.push_back(geom);
    return expectedPairs(geoms);  // none of them has a body
  }
  void collideThrowing() {
    try {
      dSpaceCollide(space_, nullptr, [](void*, dGeomID, dGeomID) { throw Stop(); });
    } catch (const Stop&) {
    }
  }
  // What is found within is another matter: a geom is disabled there, some of them for good.
  Pairs collideWithin() {
    struct Within {
      dSpaceID space;
      Pairs pairs;
      static void call(void* data, dGeomID a, dGeomID b) {
        Within& self = *static_cast<Within*>(data);
        record(&self.pairs, a, b);
        if (self.pairs.size() > 3) return;
        const Events before = begunOf(self.space);
        const bool enabled = dGeomIsEnabled(a);
        enable(self.space, a, false);
        for (int i = 0; i < 3; ++i) (void)collide(self.space);
        if (enabled && number(a) % 2) enable(self.space, a, true);
        if (begunOf(self.space) != before) throw std::logic_error("events of a collide within");
      }
    } within{space_, {}};
    dSpaceCollide(space_, &within, Within::call);
    return within.pairs;
  }
  Pairs pairsOfContacts() {
    struct Asked {
      std::mutex lock;
      Pairs pairs;
    } asked;
    dParallelSAPContactCallbacks callbacks = {};
    callbacks.contacts = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
    callbacks.flags = [](void* data, dGeomID a, dGeomID b) {
      Asked& self = *static_cast<Asked*>(data);
      const std::lock_guard<std::mutex> guard(self.lock);
      record(&self.pairs, a, b);
      return 0;
    };
    dParallelSAPSpaceCollideContacts(space_, &asked, 1, &callbacks);
    return sorted(asked.pairs);
  }

  Random random_;
  const Space space_;
  const std::size_t most_;
  double side_;
  std::map<std::size_t, dGeomID> in_;
  std::size_t next_ = 0;
  std::vector<dGeomID> outside_;
  std::string log_;
};

}  // namespace sap_test
