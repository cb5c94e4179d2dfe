// Add-ons that observe a space.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "space/geoms/pack_rules.h"
#include "space/geoms/pair_watcher.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

class SpaceObserver : public PairWatcher {
 public:
  // Whether it wants the geoms of the frame that begins, within no callback; they are clean then.
  virtual bool wantsScene() { return false; }
  virtual void seeScene(const Scene&, const PackRules&) {}
  // A frame within no callback is over, its callbacks too. `swept`: the step of swept bounds.
  virtual void endFrame(dxGeom* const* geoms, std::size_t slots, dReal swept) {
    (void)geoms, (void)slots, (void)swept;
  }
  // The space ends, whose frames took so long on average, their stages by pair and all.
  virtual void end(double pairs_ms, double frame_ms) { (void)pairs_ms, (void)frame_ms; }
  // A geom leaves the space, or with null any one may leave a sub-space while callbacks run.
  virtual void forget(const dxGeom*) {}
};

// All those of a space.
class SpaceObservers final : public PairWatcher {
 public:
  void add(std::unique_ptr<SpaceObserver> observer) {
    due_.reserve(all_.size() + 1);
    all_.push_back(std::move(observer));
  }
  // The one of this class, or null; and its end.
  template <class Observer>
  Observer* find() const {
    for (const auto& observer : all_)
      if (auto* const own = dynamic_cast<Observer*>(observer.get())) return own;
    return nullptr;
  }
  void remove(const SpaceObserver* observer) {
    for (auto& each : all_)
      if (each.get() == observer) std::swap(each, all_.back());
    if (observer) all_.pop_back();
  }

  template <class See>
  void forEach(See see) const {
    for (const auto& observer : all_) see(*observer);
  }
  bool isDue() override {
    due_.clear();
    for (const auto& observer : all_)
      if (observer->isDue()) due_.push_back(observer.get());
    return !due_.empty();
  }
  void see(dGeomID a, dGeomID b) override {
    for (SpaceObserver* const observer : due_) observer->see(a, b);
  }
  void endPairs() override {
    for (SpaceObserver* const observer : due_) observer->endPairs();
  }

 private:
  std::vector<std::unique_ptr<SpaceObserver>> all_;
  std::vector<SpaceObserver*> due_;  // that see the pairs of the frame that runs
};

}  // namespace ode_parallel_sap
