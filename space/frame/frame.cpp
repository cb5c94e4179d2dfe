#include "space/frame/frame.h"

#include <algorithm>
#include <new>

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

// Without memory for its lists a small scene goes the way of all others.
inline bool Pipeline::isSmall(const FrameCall& call) const {
  return Policy::isSmall(call.slots(), settings) && call.lists.small.makeRoom(call.scene.count);
}

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
    updateTouches(frame, pairs, narrow_phase);
    frame.begin(&dParallelSAPStats::report_ms);
    frame.stats.narrow_threads = used;
    frame.stats.contacts = narrow_phase.contacts();
    if (!call.scene.nested && observers.isDue())
      for (const dParallelSAPPair& pair : pairs.list()) observers.see(pair.o1, pair.o2);
  } catch (const std::bad_alloc&) {
    narrow_phase = NarrowPhase();  // going on one by one needs memory, too
    found = false;
    frame.begin(&dParallelSAPStats::report_ms);
    frame.stats.narrow_threads = 1;
  }
  statistics.note(frame.stats);  // should a contact callback throw, or collide again
  if (found)
    narrow_phase.report(pairs, request);
  else
    NarrowPhase::collideOneByOne(pairs, request);
  return endFrame(frame);
}

// All stages up to the report. Where memory ends, they begin anew on one thread, with all of it
// that was held. Null where it ends again, and `receiver` has got pairs as they were found.
const PairList* Pipeline::findPairs(Frame& frame, const PairReceiver& receiver) {
  for (const bool last : {false, true}) try {
      return &tryFindPairs(frame);
    } catch (const std::bad_alloc&) {
      giveBack(frame.call);
      Plan& plan = frame.plan = decide(frame.call);
      plan.threads = plan.extraction.threads = 1;
      plan.extraction.devices = 0;
      plan.fat_pairs = plan.weighs_devices = false;
      const std::size_t moved = frame.stats.moved;
      frame.stats = {};
      frame.stats.moved = moved;
      if (last && events_ && !frame.call.scene.nested) events_->updateUnknown();
    }
  reportWithoutMemory(frame, receiver);
  return nullptr;
}

const PairList& Pipeline::tryFindPairs(Frame& frame) {
  const FrameCall& call = frame.call;
  const Plan& plan = frame.plan;
  frame.stats.geoms = call.scene.count;
  frame.stats.backend = dParallelSAPBackendCPU;
  call.lists.small.changes = 0;  // its pairs are those of the last frame no more
  if (!stages_ || !made(call.lists.large)) throw std::bad_alloc();

  frame.begin(&dParallelSAPStats::update_ms);
  PairCache::Update update;
  if (plan.use_cache)
    update = stages_->cache.update(call.geoms(), call.slots(), plan.rules, plan.threads,
                                   stages_->geom_update, frame.stats);
  if (update.unannounced.count)
    complaints.ofUnannounced(call.geoms()[update.unannounced.first], update.unannounced.count);
  Found found;
  if (!update.kept || !renew(frame, update)) {
    update.kept = false;
    found = findAnew(frame);
  }
  LargeLists& lists = *call.lists.large;
  const bool user_classes = stages_->geom_update.facts().user_classes;
  const bool selects = user_classes || plan.rules.verifiesPairs();
  if (selects) {
    frame.begin(&dParallelSAPStats::filter_ms);
    verifyPairs(call.geoms(), plan.rules, user_classes, plan.threads, lists.candidates,
                lists.selected);
  }
  const PairList& pairs = selects ? lists.selected : lists.candidates;
  if (update.kept) stages_->fat.noteUnused();
  if (plan.weighs_devices) learn(frame, update.kept ? nullptr : &found);
  // Memory does not end from here on.
  updateEvents(frame, pairs, stages_->cache.noteReported(!selects, update));
  frame.begin(nullptr);
  frame.stats.pairs = pairs.size();
  stages_->cache.endFrame();
  statistics.note(frame.stats);
  if constexpr (validates) {
    stages_->geom_update.validate(call.geoms());
    stages_->cache.validate(call.geoms(), stages_->geom_update, plan.rules,
                            call.lists.large->candidates);
  }
  return pairs;
}

// What a frame that finds all pairs fills again; what the frames around it use stays.
void Pipeline::giveBack(const FrameCall& call) {
  if (call.lists.large) *call.lists.large = LargeLists();
  if (!stages_) return;
  stages_->geom_update = GeomUpdate();
  stages_->extraction.release();
  stages_->cache = PairCache();
  stages_->fat = FatProxies();
  GeomTree* const tree = call.tree.get();
  if (tree && !call.scene.nested) tree->release();
}

// The last frame's pairs, but for those of geoms that changed since. False if they must be found
// anew.
bool Pipeline::renew(Frame& frame, const PairCache::Update& update) {
  const FrameCall& call = frame.call;
  noteUpdate(frame);
  // Where nothing changed the stage is shorter than reading the clock.
  if (!update.isSame()) frame.begin(&dParallelSAPStats::extract_ms);
  frame.stats.method = dParallelSAPMethodSweep;
  return stages_->cache.renew(call.scene.slots, update, stages_->geom_update, frame.plan.threads,
                              call.tree, call.lists.large->candidates, frame.stats);
}

// update -> extract, for all geoms.
Found Pipeline::findAnew(Frame& frame) {
  const FrameCall& call = frame.call;
  const Plan& plan = frame.plan;
  stages_->cache.stop();
  const int update_threads =
      stages_->geom_update.pack(call.geoms(), call.slots(), plan.rules, plan.threads,
                                stages_->extraction.devices.reader(plan.extraction));
  noteUpdate(frame);

  frame.begin(&dParallelSAPStats::extract_ms);
  const BoxSet& boxes = stages_->geom_update.boxes();
  PairList& candidates = call.lists.large->candidates;
  const PairFilter filter(call.geoms(), stages_->geom_update, plan.rules);
  Found found;
  const bool fat = plan.fat_pairs && !boxes.wide &&
                   stages_->fat.prepare(
                       boxes, static_cast<double>(stages_->geom_update.tolerance()), plan.threads);
  if (fat) {
    found.threads =
        stages_->fat.find(boxes, plan.threads, stages_->extraction.sweep, filter, candidates);
    found.method = dParallelSAPMethodSweep;
    frame.stats.candidates_kept = stages_->fat.kept();
    if constexpr (validates) stages_->fat.validate(boxes, stages_->extraction.sweep);
  } else {
    stages_->fat.noteUnused();
    found = stages_->extraction.find(boxes, plan.extraction, filter, candidates);
  }
  if (found.too_long) complaints.ofTooLong(*found.too_long);
  frame.stats.method = found.method;
  frame.stats.devices = found.devices;
  if (found.devices > 0) frame.stats.backend = dParallelSAPBackendCUDA;
  found.threads = std::max(update_threads, found.threads);
  found.pairs = candidates.size();
  frame.stats.find_threads = found.threads;
  frame.stats.candidates = found.pairs;

  if (plan.use_cache) stages_->cache.start(call.slots());
  frame.begin(nullptr);  // the choice of devices learns from what this took
  return found;
}

// Counts the geoms, whose boxes are up to date.
void Pipeline::noteUpdate(Frame& frame) {
  frame.call.scene.noteClean();
  const UpdateFacts& facts = stages_->geom_update.facts();
  dxGeom* const* const geoms = frame.call.geoms();
  for (const Slot slot : facts.newly_invalid) complaints.ofInvalid(geoms[slot]);
  frame.stats.moved += facts.moved;
  frame.stats.disabled = static_cast<std::size_t>(facts.disabled);
  frame.stats.invalid = static_cast<std::size_t>(facts.invalid);
  frame.stats.unbounded = static_cast<std::size_t>(facts.unbounded);
}

// The pairs of a frame within a callback are no events. `are_same`: all are those of the last
// frame.
void Pipeline::updateEvents(Frame& frame, const PairList& pairs, bool are_same) {
  if (!events_ || frame.call.scene.nested) return;
  if (are_same && events_->updateSame()) return;
  frame.begin(&dParallelSAPStats::events_ms);
  if (!events_->update(pairs, frame.call.scene.slots, frame.plan.rules, frame.plan.threads))
    complaints.ofUnreportedEvents();
}

// Of a frame whose pairs have numbers and whose contacts are all known. Touches that the call
// switched on begin in the next one.
void Pipeline::updateTouches(Frame& frame, const ContactPairs& pairs, const NarrowPhase& found) {
  if (!touches_ || frame.call.scene.nested || !pairs.knowsPlaces()) return;
  frame.begin(&dParallelSAPStats::events_ms);
  if (!events_->hasEvents() || !pairs.isComplete() ||
      !touches_->update(pairs, found, *events_, frame.plan.rules, frame.plan.most_threads))
    complaints.ofUnreportedEvents();
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

SceneFacts Pipeline::factsOf(const FrameCall& call) {
  return {call.slots(), call.lists.large ? call.lists.large->candidates.size() : 0,
          stages_->geom_update.boxes().wide, call.scene.nested,
          stages_->extraction.devices.devices()};
}

// `found`: how the pairs were found anew; null if they were kept.
void Pipeline::learn(const Frame& frame, const Found* found) {
  DeviceBackend& devices = stages_->extraction.devices;
  devices.reportLeftOut();
  const int wanted = stages_->policy.learn(frame.plan, factsOf(frame.call), settings, found,
                                           frame.stats.extract_ms);
  if (wanted > 0) devices.prepare(wanted);
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
  if (isWorthResolving(frame.call.scene, frame.plan.threads) &&
      hasRoom(frame.call.lists, resolved_pairs))
    return reportResolved(pairs, frame.call.scene, frame.plan.threads, lists.contact_pairs.data(),
                          lists.limit, data, callback);
  reportPairs(pairs, frame.call.scene, lists.limit,
              [=](Pair, std::size_t, dxGeom* a, dxGeom* b) { callback(data, a, b); });
}

// The last resort: finds and reports at once.
void Pipeline::reportWithoutMemory(Frame& frame, const PairReceiver& receiver) {
  frame.begin(&dParallelSAPStats::report_ms);
  complaints.ofNoMemory();
  const std::size_t moved = frame.stats.moved;
  frame.stats = updateWithoutMemory(frame.call.scene);
  frame.stats.moved += moved;
  statistics.note(frame.stats);
  LargeLists* const lists = frame.call.lists.large.get();
  collideWithoutMemory(frame.call.scene, frame.plan.rules, lists ? &lists->last_resort : nullptr,
                       frame.stats, receiver);
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
