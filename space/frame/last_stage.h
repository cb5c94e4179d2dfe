// What an add-on may put in the place of the report of dSpaceCollide.
#pragma once

#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>

#include "space/base/box_set.h"
#include "space/base/pair_list.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

class LastStage {
 public:
  // The pairs of a frame, and how they may be collided.
  struct Pairs {
    const PairList& list;
    const Scene& scene;
    int threads;         // that the space may use
    const Pair*& limit;  // of reportPairs()
  };

  virtual ~LastStage() = default;
  // What is to be done before the report, counted in `stats`. False: the frame reports its pairs
  // itself.
  virtual bool prepare(const Pairs& pairs, dParallelSAPStats& stats) = 0;
  // Calls the callback for each of the pairs, in their order.
  virtual void report(const Pairs& pairs, void* data, dNearCallback* callback) = 0;
  // The geom of a slot has moved, changed or gone; all slots are others.
  virtual void noteChange(Slot slot) = 0;
  virtual void noteNewSlots() = 0;

  virtual void release() = 0;
  virtual std::size_t bytes() const = 0;
};

}  // namespace ode_parallel_sap
