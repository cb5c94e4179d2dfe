// dSpaceCollide, dParallelSAPSpaceCollideContacts and dParallelSAPSpaceCollidePairs: the stages of
// a frame. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

#include "space/coherence/pair_events.h"
#include "space/contacts/contact_pairs.h"
#include "space/contacts/narrow_phase.h"
#include "space/extract/extraction.h"
#include "space/filter/pair_filter.h"
#include "space/filter/plane_pairs.h"
#include "space/frame/complaints.h"
#include "space/frame/frame.h"
#include "space/frame/last_stage.h"
#include "space/frame/memory_watch.h"
#include "space/frame/pair_blocks.h"
#include "space/frame/policy.h"
#include "space/frame/small_scenes.h"
#include "space/frame/statistics.h"
#include "space/geom/pair_watcher.h"
#include "space/update/geom_update.h"

namespace ode_parallel_sap {

class Pipeline {
 public:
  explicit Pipeline(bool sums) : statistics_(sums) {}

  // The scene is locked, and no other frame uses `lists`. `callback` is called for its pairs, in
  // their order.
  void collide(const Scene& scene, FrameLists& lists, const Settings& settings, void* data,
               dNearCallback* callback);
  // The contacts of its pairs. `manual_cleanup`: threads leave no data in ODE.
  void collideContacts(const Scene& scene, FrameLists& lists, const Settings& settings,
                       const ContactRequest& request, bool manual_cleanup);
  // Its pairs in blocks.
  void collidePairs(const Scene& scene, FrameLists& lists, const Settings& settings,
                    const PairsRequest& request);
  // Of a geom that a query is for.
  void complainOfInvalid(const dxGeom* geom) { complaints_.ofInvalid(geom); }
  // Brings the AABBs of all geoms up to date, as for a frame.
  void clean(const Scene& scene, const Settings& settings);
  int teamFor(std::size_t slots, const Settings& settings) const {
    return policy_.teamFor(slots, settings);
  }
  int threadsForRays(std::size_t rays, const Settings& settings) const {
    return policy_.threadsForRays(rays, settings);
  }
  void learnOfBatch(const Settings& settings, const Batch& batch) {
    policy_.learnOfBatch(settings, batch);
  }

  // The geom of a slot is new, gone or has moved.
  void noteChange(Slot slot) {
    small_scenes_.noteChange();
    store_.coherence.change(slot);
    if (last_stage_) last_stage_->noteChange(slot);
  }
  // What ODE tells no space of may have changed in the geom of a slot, or in all; the former from
  // many threads at once.
  void noteUntold(Slot slot) { store_.coherence.tell(slot); }
  void noteAllUntold() { store_.coherence.tellAll(); }
  // A setting may change, or what is told of frames.
  void noteSettings() { store_.repeats = false; }
  // Geoms come or go.
  void noteNewcomer() { plane_pairs_.forget(); }
  // The slots of these geoms are about to be closed up.
  void closeSlots(const Buffer<dxGeom*>& geoms) {
    store_.coherence.stop();
    plane_pairs_.forget();
    if (last_stage_) last_stage_->noteNewSlots();
    if (events_.on()) events_.closeSlots(geoms);
  }
  // A geom leaves its slot.
  void forget(const dxGeom* geom, Slot slot) {
    complaints_.forget(geom);
    if (events_.on()) events_.forget(slot);
  }

  // Counts a frame of so many geoms. The part of what is held that is to be given back.
  int noteMemory(std::size_t geoms) { return memory_watch_.noteFrame(geoms, last_pairs_); }
  // Gives back a part of what is held, but for the devices. No frame uses `lists`.
  void release(int part, FrameLists& lists);
  std::size_t bytes() const;
  // Who sees the pairs of some frames; may be null.
  void watchPairs(PairWatcher* watcher) { watcher_ = watcher; }
  PairEvents& events() { return events_; }
  const PairEvents& events() const { return events_; }
  // What takes the place of the report of dSpaceCollide.
  void setLastStage(std::unique_ptr<LastStage> last_stage) { last_stage_ = std::move(last_stage); }
  Statistics& statistics() { return statistics_; }
  const Statistics& statistics() const { return statistics_; }

 private:
  // Whether a frame that reports nothing would do as little as the last one. True: settings and
  // geoms are the same, so that neither they nor the plan need be looked at.
  bool repeatsLastFrame() const {
    return store_.repeats && store_.coherence.wouldRepeat(geom_update_);
  }
  SceneFacts factsOf(const Scene& scene, bool for_contacts) const;
  bool findPairs(Frame& frame, const Settings& settings);
  bool findChanges(Frame& frame);
  void findAnew(Frame& frame);
  void extract(Frame& frame);
  void takeNotice(Frame& frame);
  bool select(Frame& frame);
  void tellEvents(Frame& frame, bool kept);
  void learn(const Frame& frame, const Settings& settings);
  void note(const FrameResult& result);
  bool reportByLastStage(Frame& frame, const Settings& settings, void* data,
                         dNearCallback* callback);
  void report(const Frame& frame, void* data, dNearCallback* callback);
  void reportWithoutMemory(Frame& frame, void* data, dNearCallback* callback);
  void showPairs(const Frame& frame) const;
  FrameCounts collideSmall(const Scene& scene, const Settings& settings, const SmallReport& report,
                           PairWatcher* watcher);
  Plan collectPairs(const Scene& scene, FrameLists& lists, const Settings& settings,
                    ContactPairs& pairs, FrameResult& result);

  Policy policy_;
  FrameStore store_;
  GeomUpdate geom_update_;
  BoxSet boxes_;
  Extraction extraction_;
  PairFilter pair_filter_;
  PlanePairs plane_pairs_;
  // Where the pairs reported in the last frame are not all that may have to be reported in the next
  // one: those. And those of others than planes, where planes' are found apart.
  PairList candidates_, others_;
  bool candidates_apart_ = false;
  PairEvents events_;
  std::unique_ptr<LastStage> last_stage_;
  SmallScenes small_scenes_;
  Complaints complaints_;
  Statistics statistics_;
  PairWatcher* watcher_ = nullptr;
  MemoryWatch memory_watch_;
  std::size_t last_pairs_ = 0;
};

}  // namespace ode_parallel_sap
