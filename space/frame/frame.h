// One frame on its way through the stages, with all that one stage leaves to the next.
#pragma once

#include <cstddef>

#include "space/contacts/narrow_phase.h"
#include "space/data/buffer.h"
#include "space/data/pair_list.h"
#include "space/frame/frame_result.h"
#include "space/frame/plan.h"
#include "space/frame/stage_clock.h"
#include "space/geom/scene.h"
#include "space/update/geom_update.h"

namespace ode_parallel_sap {

// The lists of a frame, which outlast it. Those of frames within no callback are the same.
struct FrameLists {
  PairList pairs;  // of the last frame, then of this one
  Buffer<dParallelSAPPair> contact_pairs;
  NarrowPhase narrow_phase;

  void release() {
    pairs = PairList();
    contact_pairs.release();
    narrow_phase = NarrowPhase();
  }
  std::size_t bytes() const { return bytesOf(pairs, contact_pairs, narrow_phase); }
};

// What frames of one space leave to the next one.
struct FrameStore {
  bool complete = false;  // the last frame came to its report: what is kept is of its pairs
  bool repeats = false;   // it found all as it was, and reported nothing
  PairKeeper coherence;
  FatPairs fat_pairs;

  // Of use to a frame that begins; null where nothing is.
  const SlotSet* changed() const { return complete ? coherence.changed() : nullptr; }
};

// A callback may collide the space again: what is kept is of no use to that frame nor to the next.
// A callback may be left in any way, so nothing is left to a destructor.
struct Frame {
  Frame(FrameStore& store, FrameLists& lists, const Plan& plan, const SceneFacts& facts,
        const Scene& scene)
      : plan(plan), facts(facts), scene(scene), pairs(lists.pairs) {
    result.geoms = scene.count;
    if (!store.complete || scene.nested) store.coherence.stop();
    store.complete = store.repeats = false;
  }

  dxGeom* const* geoms() const { return scene.slots.data(); }
  std::size_t slots() const { return scene.slots.size(); }

  const Plan plan;
  const SceneFacts facts;
  const Scene scene;
  PairList& pairs;                       // of the last frame, then of this one
  const UpdateFacts* updated = nullptr;  // of the geoms, until the report
  bool same = false;                     // as in the last frame: no event
  FrameResult result;
  StageClock clock;
};

}  // namespace ode_parallel_sap
