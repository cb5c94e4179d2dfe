#include "space/frame/frame.h"

#include <algorithm>
#include <new>

#include "space/base/mechanisms.h"
#include "space/base/validate.h"
#include "space/frame/without_memory.h"
#include "space/geoms/pair_filter.h"

namespace ode_parallel_sap {

namespace {

bool hasRoom(FrameLists& lists, std::size_t pairs) try {
  if (made(lists.large)) lists.large->contact_pairs.reserve(pairs);
  return lists.large != nullptr;
} catch (const std::bad_alloc&) {
  return false;
}

}  // namespace

std::size_t Pipeline::collide(const FrameCall& call, void* data, dNearCallback* callback) {
  beginFrame(call, /*contacts=*/false);
  const PairReceiver receiver = {data, callback, nullptr, true};
  if (isSmall(call))
    return statistics.endFrame(collideSmall(call, receiver, /*shows_pairs=*/true).pairs);
  Frame frame = {call, decide(call)};
  if (const PairList* const pairs = findPairs(frame, receiver)) {
    showPairs(call, *pairs);
    report(frame, *pairs, data, callback);
  }
  return endFrame(frame);
}

// The stages up to the report. Throws std::bad_alloc.
const PairList& Pipeline::tryFindPairs(Frame& frame) {
  const FrameCall& call = frame.call;
  const Plan& plan = frame.plan;
  dParallelSAPStats& stats = frame.stats;
  stats.geoms = call.scene.count;
  stats.backend = dParallelSAPBackendCPU;
  call.lists.small.changes = 0;  // its pairs are those of the last frame no more
  if (!stages_ || !made(call.lists.large)) throw std::bad_alloc();
  auto& [policy, update, extraction, cache, fat] = *stages_;
  const BoxSet& boxes = update.boxes();
  PairList& candidates = call.lists.large->candidates;

  frame.begin(&dParallelSAPStats::update_ms);
  const PairCache::Kept kept = cache.begin(plan.use_cache, call.scene.slots, plan.rules,
                                           plan.threads, call.tree, update, stats);
  if (kept.unannounced.count)
    complaints.ofUnannounced(call.geoms()[kept.unannounced.first], kept.unannounced.count);
  if (!kept.any) {
    stats.find_threads = update.pack(call.geoms(), call.slots(), plan.rules, plan.threads,
                                     extraction.devices.reader(plan.extraction));
    stats.moved += update.facts().moved;
    if (plan.use_cache) cache.start(call.slots());
  }
  call.scene.noteClean();
  const UpdateFacts& facts = update.facts();
  for (const Slot slot : facts.newly_invalid) complaints.ofInvalid(call.geoms()[slot]);
  stats.disabled = static_cast<std::size_t>(facts.disabled);
  stats.invalid = static_cast<std::size_t>(facts.invalid);
  stats.unbounded = static_cast<std::size_t>(facts.unbounded);

  // Where nothing changed the stage is shorter than reading the clock.
  if (!kept.isSame()) frame.begin(&dParallelSAPStats::extract_ms);
  const PairFilter filter(call.geoms(), update, plan.rules);
  Found found;
  found.method = dParallelSAPMethodSweep;
  if (kept.any) {
    found.threads =
        cache.renew(kept, call.scene.slots, update, filter, plan.threads, candidates, stats);
    fat.noteUnused();
  } else if (plan.fat_pairs && !boxes.wide &&
             fat.prepare(boxes, static_cast<double>(update.tolerance()), plan.threads)) {
    found.threads = fat.find(boxes, plan.threads, extraction.sweep, filter, candidates);
    stats.candidates_kept = fat.kept();
    if constexpr (validates) fat.validate(boxes, extraction.sweep);
  } else {
    fat.noteUnused();
    found = extraction.find(boxes, plan.extraction, filter, candidates);
    if (GeomTree* const tree = call.tree.get(); tree && !call.scene.nested &&
                                                found.method == dParallelSAPMethodSweep &&
                                                found.devices == 0 && !boxes.wide)
      tree->takeFrom(extraction.sweep, call.scene.slots, stats.disabled + stats.invalid);
  }
  noteFound(frame, found, kept.any);

  // Memory does not end after this one.
  const PairList& pairs = select(frame);
  updateEvents(frame, pairs, kept.isSame() && &pairs == &candidates);
  frame.begin(nullptr);
  stats.pairs = pairs.size();
  cache.end();
  statistics.note(stats);
  if constexpr (validates) {
    update.validate(call.geoms());
    cache.validate(call.geoms(), update, plan.rules, candidates);
  }
  return pairs;
}

// The candidates were found, or `kept` and made those of this frame.
void Pipeline::noteFound(Frame& frame, const Found& found, bool kept) {
  dParallelSAPStats& stats = frame.stats;
  if (found.too_long) complaints.ofTooLong(*found.too_long);
  stats.method = found.method;
  stats.devices = found.devices;
  if (found.devices > 0) stats.backend = dParallelSAPBackendCUDA;
  stats.find_threads = std::max(stats.find_threads, found.threads);
  if (!kept) stats.candidates = frame.call.lists.large->candidates.size();
  if (!frame.plan.weighs_devices) return;
  frame.begin(nullptr);  // the choice of devices learns from what this took
  DeviceBackend& devices = stages_->extraction.devices;
  devices.reportLeftOut();
  const int wanted =
      stages_->policy.learn(frame.plan, factsOf(frame.call), settings, kept ? nullptr : &stats);
  if (wanted > 0) devices.prepare(wanted);
}

// Those of the candidates that are reported.
const PairList& Pipeline::select(Frame& frame) {
  LargeLists& lists = *frame.call.lists.large;
  const bool user_classes = stages_->geom_update.facts().user_classes;
  if (!user_classes && !frame.plan.rules.verifiesPairs()) return lists.candidates;
  frame.begin(&dParallelSAPStats::filter_ms);
  verifyPairs(frame.call.geoms(), frame.plan.rules, user_classes, frame.plan.threads,
              lists.candidates, lists.selected);
  return lists.selected;
}

// Pairs of a frame within a callback are no events. `are_same`: all are those of the last frame.
void Pipeline::updateEvents(Frame& frame, const PairList& pairs, bool are_same) {
  if (!events_ || frame.call.scene.nested) return;
  if (are_same && events_->updateSame()) return;
  frame.begin(&dParallelSAPStats::events_ms);
  if (!events_->update(pairs, frame.call.scene.slots, frame.plan.rules, frame.plan.threads))
    complaints.ofUnreportedEvents();
}

// Shows the pairs to who watches, before the program gets them.
void Pipeline::showPairs(const FrameCall& call, const PairList& pairs) {
  if (call.scene.nested || !observers.isDue()) return;
  for (const PairList::Run& run : pairs.runs)
    for (const Pair pair : run)
      observers.see(call.geoms()[earlierOf(pair)], call.geoms()[laterOf(pair)]);
  observers.endPairs();
}

// The last stage may collide a part of the pairs first, as if it were all.
void Pipeline::report(Frame& frame, const PairList& pairs, void* data, dNearCallback* callback) {
  const bool by_last_stage = last_stage && !frame.call.scene.nested;
  if (by_last_stage) frame.begin(&dParallelSAPStats::narrow_ms);
  const bool prepared = by_last_stage && last_stage->prepare(frame, pairs);
  frame.begin(&dParallelSAPStats::report_ms);
  if (prepared) {
    statistics.note(frame.stats);  // should the callback throw, or collide again
    return last_stage->report(frame, pairs, data, callback);
  }
  const Reports::Open open(frame.call.scene.reports);
  LargeLists& lists = *frame.call.lists.large;
  const Scene& scene = frame.call.scene;
  const int threads = frame.plan.threads;
  if (((scene.slots.size() >= far_slots && threads >= least_resolving_threads) ||
       (threads > 1 && teamsAreTested())) &&
      hasRoom(frame.call.lists, resolved_pairs))
    return reportResolved(pairs, scene, threads, lists.contact_pairs.data(), lists.limit, data,
                          callback);
  reportPairs(pairs, scene, lists.limit,
              [=](Pair, std::size_t, dxGeom* a, dxGeom* b) { callback(data, a, b); });
}

// Where memory ends, the stages begin anew on one thread, with all of it that was held. Where it
// ends again, `receiver` gets the pairs as they are found; null.
const PairList* Pipeline::findPairs(Frame& frame, const PairReceiver& receiver) {
  const FrameCall& call = frame.call;
  for (const bool last : {false, true}) try {
      return &tryFindPairs(frame);
    } catch (const std::bad_alloc&) {
      // What the stages fill again; what the frames around this one use stays.
      if (call.lists.large) *call.lists.large = LargeLists();
      if (stages_) {
        stages_->geom_update = GeomUpdate();
        stages_->extraction.release();
        stages_->cache = PairCache();
        stages_->fat = FatProxies();
        if (GeomTree* const tree = call.tree.get(); tree && !call.scene.nested) tree->release();
      }
      Plan& plan = frame.plan = decide(call);
      plan.threads = plan.extraction.threads = 1;
      plan.extraction.devices = 0;
      plan.fat_pairs = plan.weighs_devices = false;
      const std::size_t moved = frame.stats.moved;
      frame.stats = {};
      frame.stats.moved = moved;
      if (last && events_ && !call.scene.nested) events_->updateUnknown();
    }
  frame.begin(&dParallelSAPStats::report_ms);
  complaints.ofNoMemory();
  const std::size_t moved = frame.stats.moved;
  frame.stats = updateWithoutMemory(call.scene);
  frame.stats.moved += moved;
  statistics.note(frame.stats);
  LargeLists* const lists = call.lists.large.get();
  collideWithoutMemory(call.scene, frame.plan.rules, lists ? &lists->last_resort : nullptr,
                       frame.stats, receiver);
  return nullptr;
}

void Pipeline::beginFrame(const FrameCall& call, bool contacts) {
  statistics.beginFrame();
  if (touches_ && !call.scene.nested) touches_->beginFrame(*events_, contacts);
}

std::size_t Pipeline::endFrame(Frame& frame) {
  frame.begin(nullptr);
  statistics.note(frame.stats);
  return statistics.endFrame(frame.stats.pairs);
}

// What the frame is to do: without memory for the stages, to go pair by pair.
Plan Pipeline::decide(const FrameCall& call) {
  if (made(stages_)) return stages_->policy.decide(factsOf(call), settings);
  Plan plan;
  plan.rules = settings.rules;
  return plan;
}

// Whether it is collided on the spot (small_scenes.cpp). Without memory for its lists it is not.
inline bool Pipeline::isSmall(const FrameCall& call) const {
  return mechanisms::small_scenes && call.slots() <= small_scene_slots &&
         (settings.method == dParallelSAPMethodAuto ||
          settings.method == dParallelSAPMethodBruteForce) &&
         settings.backend != dParallelSAPBackendCUDA && call.lists.small.makeRoom(call.scene.count);
}

SceneFacts Pipeline::factsOf(const FrameCall& call) {
  return {call.slots(), call.lists.large ? call.lists.large->candidates.size() : 0,
          stages_->geom_update.boxes().wide, call.scene.nested,
          stages_->extraction.devices.devices()};
}

std::size_t Pipeline::collidePairs(const FrameCall& call, const PairsRequest& request) {
  beginFrame(call, /*contacts=*/false);
  if (!isSmall(call) || !hasRoom(call.lists, PairBlock::size))
    return collideManyPairs(call, request);
  PairBlock block(request, call.lists.large->contact_pairs.data());
  return statistics.endFrame(collideSmall(call, block.receiver(), /*shows_pairs=*/true).pairs);
}

// With room on the stack, should memory end. Not inline: small scenes have no need of it.
__attribute__((noinline)) std::size_t Pipeline::collideManyPairs(const FrameCall& call,
                                                                 const PairsRequest& request) {
  dParallelSAPPair room[PairBlock::size];
  PairBlock block(request, room);
  Frame frame = {call, decide(call)};
  if (const PairList* const pairs = findPairs(frame, block.receiver())) {
    showPairs(call, *pairs);
    frame.begin(&dParallelSAPStats::report_ms);
    frame.stats.threads = handOutBlocks(*pairs, call.scene, request, frame.plan.most_threads);
  }
  return endFrame(frame);
}

std::size_t Pipeline::collideContacts(const FrameCall& call, const ContactRequest& request,
                                      LargeLists& lists) {
  beginFrame(call, /*contacts=*/true);
  Frame frame = {call, decide(call)};
  ContactPairs pairs(request, call.scene, lists.contact_pairs, lists.contact_slots,
                     touches_ && !call.scene.nested ? &lists.contact_firsts : nullptr);
  const PairReceiver receiver = {&pairs, &dParallelSAPAddPair, nullptr, false};
  if (isSmall(call)) {
    frame.begin(&dParallelSAPStats::extract_ms);
    frame.stats = statsOf(collideSmall(call, receiver, /*shows_pairs=*/false));
  } else if (const PairList* const found = findPairs(frame, receiver)) {
    pairs.add(*found, stages_->geom_update.facts().spaces, frame.plan.threads);
  }

  NarrowPhase& narrow_phase = lists.narrow_phase;
  frame.begin(&dParallelSAPStats::narrow_ms);
  bool found = true;
  const bool knows_touches =
      touches_ && !call.scene.nested && events_->hasEvents() && pairs.isOfScene();
  try {
    const int used =
        narrow_phase.run(pairs.list(), request, frame.plan.most_threads, call.manual_cleanup,
                         knows_touches ? events_->touches() : nullptr);
    // Touches that a callback of the call switched on begin in the next one.
    if (touches_ && !call.scene.nested && pairs.knowsPlaces()) {
      frame.begin(&dParallelSAPStats::events_ms);
      if (!events_->hasEvents() || !pairs.isComplete() ||
          !touches_->update(pairs, narrow_phase, *events_, frame.plan.rules,
                            frame.plan.most_threads))
        complaints.ofUnreportedEvents();
    }
    frame.stats.narrow_threads = used;
    frame.stats.contacts = narrow_phase.contacts();
    if (!call.scene.nested && observers.isDue())
      for (const dParallelSAPPair& pair : pairs.list()) observers.see(pair.o1, pair.o2);
  } catch (const std::bad_alloc&) {
    narrow_phase = NarrowPhase();  // going on one by one needs memory, too
    found = false;
    frame.stats.narrow_threads = 1;
  }
  frame.begin(&dParallelSAPStats::report_ms);
  statistics.note(frame.stats);  // should a contact callback throw, or collide again
  if (found)
    narrow_phase.report(pairs, request);
  else
    NarrowPhase::collideOneByOne(pairs, request);
  return endFrame(frame);
}

void Pipeline::turnEvents(int kinds) {
  if (touches_ && !(kinds & dParallelSAPEventTouches)) {
    touches_->end(*events_);
    touches_.reset();
  }
  if (!kinds) events_.reset();
  event_kinds_ = 0;
  if (!kinds || !made(events_)) return;
  event_kinds_ = kinds & dParallelSAPEventPairs;
  if (kinds & dParallelSAPEventTouches && made(touches_)) {
    event_kinds_ |= dParallelSAPEventTouches;
    events_->keepTouches();
  }
}

void Pipeline::clean(const Scene& scene) {
  if (scene.slots.size() <= small_scene_slots || !cleanMany(scene))
    cleanOneByOne(scene.first);  // which takes less of the stack for spaces in spaces
  scene.noteClean();
}

// False without memory.
__attribute__((noinline)) bool Pipeline::cleanMany(const Scene& scene) try {
  if (!made(stages_)) return false;
  stages_->geom_update.clean(scene.slots.data(), scene.slots.size(),
                             Policy::teamFor(scene.slots.size(), settings),
                             stages_->cache.changed());
  return true;
} catch (const std::bad_alloc&) {
  return false;
}

void Pipeline::closeSlots(const Buffer<dxGeom*>& geoms) {
  if (stages_) stages_->cache.stop();
  if (last_stage) last_stage->noteNewSlots();
  if (events_) events_->closeSlots(geoms);
}

void Pipeline::release(int part, FrameLists& lists) {
  if (!stages_) return;
  stages_->cache.stop();
  switch (part) {
    case 0:
      lists = FrameLists();
      break;
    case 1:
      stages_->geom_update = GeomUpdate();
      break;
    case 2:
      if (events_) events_->release();
      if (touches_) touches_->release();
      if (last_stage) last_stage->release();
      break;
    default:  // at last: frames that find all anew begin to fill the cache
      stages_->extraction.release();
      stages_->cache = PairCache();
      stages_->fat = FatProxies();
  }
}

std::size_t Pipeline::bytes() const {
  return bytesOf(stages_, events_, touches_, last_stage, small_pairs_);
}

}  // namespace ode_parallel_sap
