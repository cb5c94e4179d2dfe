// Add-ons that observe a space.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "space/geoms/pair_rule.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

class SpaceObserver {
 public:
  virtual ~SpaceObserver() = default;
  // Whether it wants the geoms of the frame that begins, within no callback; they are clean then.
  virtual bool wantsScene() { return false; }
  virtual void seeScene(const Scene&, const PairRules&) {}
  // Whether it wants the pairs of the frame that runs, within no callback.
  virtual bool isDue() = 0;
  // One of these pairs. The space is locked.
  virtual void see(dGeomID a, dGeomID b) = 0;
  // These were all, of a frame without contacts.
  virtual void endPairs() {}
  // A frame within no callback is over, its callbacks too. `any_moved`: since the one before.
  virtual void endFrame(dxSpace* space, bool any_moved) { (void)space, (void)any_moved; }
  // A geom leaves the space.
  virtual void forget(const dxGeom*) {}

 private:
  friend class SpaceObservers;
  bool is_due_ = false;  // it sees the pairs of the frame that runs
};

// All those of a space.
class SpaceObservers {
 public:
  void add(std::unique_ptr<SpaceObserver> observer) { all_.push_back(std::move(observer)); }
  // The one of this class, or null; and its end.
  template <class Observer>
  Observer* find() const {
    for (const auto& each : all_)
      if (auto* const own = dynamic_cast<Observer*>(each.get())) return own;
    return nullptr;
  }
  void remove(const SpaceObserver* observer) {
    const auto isIt = [=](const auto& each) { return each.get() == observer; };
    all_.erase(std::remove_if(all_.begin(), all_.end(), isIt), all_.end());
  }

  template <class See>
  void forEach(See see) const {
    for (const auto& each : all_) see(*each);
  }
  bool isDue() {
    bool any = false;
    forEach([&](SpaceObserver& each) { any |= each.is_due_ = each.isDue(); });
    return any;
  }
  void see(dGeomID a, dGeomID b) {
    forEach([=](SpaceObserver& each) {
      if (each.is_due_) each.see(a, b);
    });
  }
  void endPairs() {
    forEach([](SpaceObserver& each) {
      if (each.is_due_) each.endPairs();
    });
  }

 private:
  std::vector<std::unique_ptr<SpaceObserver>> all_;
};

}  // namespace ode_parallel_sap
