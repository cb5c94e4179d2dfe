// A frame and its stages: dSpaceCollide, dParallelSAPSpaceCollideContacts and -CollidePairs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "space/cache/fat_proxies.h"
#include "space/cache/pair_cache.h"
#include "space/cache/pair_events.h"
#include "space/contacts/contact_pairs.h"
#include "space/contacts/narrow_phase.h"
#include "space/finders/extraction.h"
#include "space/frame/policy.h"
#include "space/frame/reports.h"
#include "space/frame/statistics.h"
#include "space/frame/touch_events.h"
#include "space/geoms/geom_update.h"
#include "space/geoms/space_observer.h"

namespace ode_parallel_sap {

// Places in a list of geoms; read as they are written, in one word.
struct PlacePair {
  static_assert(small_scene_slots <= 0x80, "a place has seven bits");
  std::uint16_t places;
  unsigned earlier() const { return places >> 8; }
  unsigned later() const { return places & 0x7f; }
  // Boxes that overlap, but are no pair.
  bool isLeftOut() const { return places & 0x80; }
  void leaveOut(bool out) {
    places = static_cast<std::uint16_t>((places & ~0x80) | (out ? 0x80 : 0));
  }
};

// What a small frame finds: not on the stack, which may be small, and deep in nested callbacks.
struct SmallLists {
  Buffer<dxGeom*> active;   // the geoms that take part
  Buffer<PlacePair> pairs;  // of places in these: the boxes that overlap
  Buffer<Group<dReal>> boxes;
  unsigned actives = 0, overlaps = 0, unbounded = 0;
  bool user_classes = false;  // among the geoms
  bool takes_all = false;     // all overlaps are pairs
  bool same = false;          // the pairs are those of the frame before
  // How often a geom had become dirty, come or gone when the last frame began; 0: none has.
  std::uint64_t changes = 0;

  // For all pairs of so many geoms. False without memory for it.
  bool makeRoom(std::size_t geoms) { return geoms <= active.size() || grow(geoms); }
  std::size_t bytes() const { return bytesOf(active, pairs, boxes); }

 private:
  bool grow(std::size_t geoms);
};

// The lists of a frame that is not small, or of one with contacts or blocks.
struct LargeLists {
  PairList candidates;  // the pairs by boxes; kept for the next frame
  PairList selected;    // those of them that are reported, if not all are
  Buffer<dParallelSAPPair> contact_pairs;
  Buffer<Pair> contact_slots;  // of their geoms, or of the sub-spaces that these are in
  Buffer<std::size_t> contact_firsts;
  NarrowPhase narrow_phase;
  const void* limit = nullptr;  // of reportUnchanged()
  Buffer<Pair> last_resort;     // of collideWithoutMemory()

  std::size_t bytes() const {
    return bytesOf(candidates, selected, contact_pairs, contact_slots, contact_firsts, narrow_phase,
                   last_resort);
  }
};

// The lists of a frame, the same from frame to frame. A frame within a callback has others.
struct FrameLists {
  SmallLists small;
  std::unique_ptr<LargeLists> large;  // made when a frame first needs them

  std::size_t bytes() const { return bytesOf(small, large); }
};

// A call for the pairs of a scene, which is locked. No other frame uses `lists`.
struct FrameCall {
  const Scene scene;
  FrameLists& lists;
  SharedPart<GeomTree>& tree;  // of the scene
  bool manual_cleanup;         // threads leave no data in ODE

  dxGeom* const* geoms() const { return scene.slots.data(); }
  std::size_t slots() const { return scene.slots.size(); }
};

// One frame. A callback may leave it in any way, so nothing is left to its destructor.
struct Frame {
  const FrameCall& call;
  Plan plan;  // changes only if memory ends
  dParallelSAPStats stats = {};

  // Ends the time of the running stage, and starts that of another; null: of none.
  void begin(double dParallelSAPStats::*stage) {
    const Clock::time_point now = Clock::now();
    if (stage_ms) stats.*stage_ms += milliseconds(last, now);
    stats.total_ms = milliseconds(first, now);
    last = now;
    stage_ms = stage;
  }

  const Clock::time_point first = Clock::now();
  Clock::time_point last = first;
  double dParallelSAPStats::*stage_ms = nullptr;
};

// What an add-on may put in the place of the report of dSpaceCollide.
class LastStage {
 public:
  virtual ~LastStage() = default;
  // What is to be done with the pairs before the report. False: the frame reports them itself.
  virtual bool prepare(Frame& frame, const PairList& pairs) = 0;
  // Calls the callback for each of the pairs, in their order.
  virtual void report(const Frame& frame, const PairList& pairs, void* data,
                      dNearCallback* callback) = 0;
  // The geom of a slot has moved, changed or gone; all slots are others.
  virtual void noteChange(Slot slot) = 0;
  virtual void noteNewSlots() = 0;

  virtual void release() = 0;
  virtual std::size_t bytes() const = 0;
};

// What a space keeps from frame to frame, and the stages that use it.
class Pipeline {
 public:
  explicit Pipeline(const Settings& all) : settings(all), statistics(all.print_stats) {}

  // Each returns the number of pairs.
  std::size_t collide(const FrameCall& call, void* data, dNearCallback* callback);
  std::size_t collideContacts(const FrameCall& call, const ContactRequest& request,
                              LargeLists& lists);
  std::size_t collidePairs(const FrameCall& call, const PairsRequest& request);

  // Brings the AABBs of all geoms up to date, as for a frame.
  void clean(const Scene& scene);
  // The geom of a slot is new, gone or has moved.
  void noteChange(Slot slot) {
    ++changes_;
    if (stages_) stages_->cache.note(slot);
    if (last_stage) last_stage->noteChange(slot);
  }
  // A geom, or with null any, may be another in a way that ODE reports to no space. The former from
  // many threads at once.
  void notify(const dxGeom* geom) {
    if (!stages_) return;
    geom ? stages_->cache.noteShared(Slots::slotOf(geom)) : stages_->cache.noteAll();
  }
  void noteDeparture(dxGeom* geom, Slot slot) {
    complaints.forget(geom);
    PairEvents::forget(geom);
    if (events_) events_->removeGeom(slot);
  }
  // The slots of these geoms are about to be closed up.
  void closeSlots(const Buffer<dxGeom*>& geoms);

  // Those of dParallelSAPEventPairs and -Touches. Touches have the numbers of pairs, so the pairs'
  // are kept for them, too. Without memory they stay off.
  void turnEvents(int kinds);
  int eventKinds() const { return event_kinds_; }
  const PairEvents& events() const {
    static const PairEvents off;
    return event_kinds_ & dParallelSAPEventPairs ? *events_ : off;
  }
  const TouchEvents& touches() const {
    static const TouchEvents off;
    return touches_ ? *touches_ : off;
  }
  // Gives back a part of what is held, but for the devices. No frame uses `lists`.
  static constexpr int parts = 4;
  void release(int part, FrameLists& lists);
  std::size_t bytes() const;

  Settings settings;
  Complaints complaints;
  Statistics statistics;
  SpaceObservers observers;               // not changed while the space is locked
  std::unique_ptr<LastStage> last_stage;  // takes the place of the report of dSpaceCollide

 private:
  // What only frames need that are not small.
  struct Stages {
    Policy policy;
    GeomUpdate geom_update;
    Extraction extraction;
    PairCache cache;
    FatProxies fat;

    std::size_t bytes() const { return bytesOf(geom_update, extraction, cache, fat); }
  };

  const PairList& tryFindPairs(Frame& frame);
  void noteFound(Frame& frame, const Found& found, bool kept);
  const PairList& select(Frame& frame);
  void updateEvents(Frame& frame, const PairList& pairs, bool are_same);
  void showPairs(const FrameCall& call, const PairList& pairs);
  void report(Frame& frame, const PairList& pairs, void* data, dNearCallback* callback);
  const PairList* findPairs(Frame& frame, const PairReceiver& receiver);
  void beginFrame(const FrameCall& call, bool contacts);
  std::size_t endFrame(Frame& frame);
  SceneFacts factsOf(const FrameCall& call);
  Plan decide(const FrameCall& call);
  inline bool isSmall(const FrameCall& call) const;
  FrameCounts collideSmall(const FrameCall& call, const PairReceiver& receiver, bool shows_pairs);
  bool updateSmallEvents(const FrameCall& call, unsigned pair_count);
  std::size_t collideManyPairs(const FrameCall& call, const PairsRequest& request);
  bool cleanMany(const Scene& scene);

  std::unique_ptr<Stages> stages_;
  int event_kinds_ = 0;
  std::unique_ptr<PairEvents> events_;     // if any are on
  std::unique_ptr<TouchEvents> touches_;   // if these are on
  std::uint64_t changes_ = 1;              // how often a geom became dirty, came or went
  std::unique_ptr<PairList> small_pairs_;  // of a small frame with events, by slot
};

}  // namespace ode_parallel_sap
