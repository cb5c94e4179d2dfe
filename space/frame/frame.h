// One frame on its way through the stages, with all that one stage leaves to the next.
#pragma once

#include <utility>

#include "space/data/pair_list.h"
#include "space/frame/frame_result.h"
#include "space/frame/plan.h"
#include "space/frame/stage_clock.h"
#include "space/geom/scene.h"
#include "space/update/geom_update.h"

namespace ode_parallel_sap {

// What frames of one space leave to the next one, while none runs.
struct FrameStore {
  class Frame* innermost = nullptr;  // that runs
  bool repeats = false;              // the last frame found all as it was, and reported nothing
  PairList pairs;                    // reported in the last frame
  PairKeeper coherence;
  FatPairs fat_pairs;
};

// A callback may collide the space again: that frame finds the store without pairs, and what is
// kept is of no use to either. Whatever way a frame ends, its lists go back.
class Frame {
 public:
  Frame(FrameStore& store, const Plan& plan, const SceneFacts& facts, const Scene& scene)
      : plan(plan),
        facts(facts),
        scene(scene),
        pairs(std::move(store.pairs)),
        store_(store),
        outer_(store.innermost) {
    result.geoms = scene.count;
    for (Frame* outer = outer_; outer; outer = outer->outer_) outer->overtaken_ = true;
    store_.innermost = this;
    store_.repeats = false;
  }
  ~Frame() {
    store_.innermost = outer_;
    store_.pairs = std::move(pairs);
    if (!found || overtaken_) store_.coherence.stop();
  }
  Frame(const Frame&) = delete;
  Frame& operator=(const Frame&) = delete;

  dxGeom* const* geoms() const { return scene.slots.data(); }
  std::size_t slots() const { return scene.slots.size(); }

  const Plan plan;
  const SceneFacts facts;
  const Scene scene;
  PairList pairs;                        // of the last frame, then of this one
  const UpdateFacts* updated = nullptr;  // of the geoms, until the report
  bool found = false;                    // `pairs` are complete
  bool same = false;                     // as in the last frame: no event
  FrameResult result;
  StageClock clock;

 private:
  FrameStore& store_;
  Frame* const outer_;
  bool overtaken_ = false;
};

}  // namespace ode_parallel_sap
