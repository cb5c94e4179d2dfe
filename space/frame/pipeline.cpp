#include "space/frame/pipeline.h"

#include <algorithm>
#include <new>
#include <utility>

#include "space/frame/geoms_ahead.h"
#include "space/frame/without_memory.h"

namespace ode_parallel_sap {

void Pipeline::collide(const Scene& scene, FrameLists& lists, const Settings& settings, void* data,
                       dNearCallback* callback) {
  statistics_.beginFrame();
  if (Policy::isSmall(scene.slots.size(), settings)) {
    collideSmall(scene, settings, {data, callback}, watcher_);
  } else {
    const SceneFacts facts = factsOf(scene, false);
    Frame frame(store_, lists, policy_.decide(facts, settings), facts, scene);
    if (findPairs(frame, settings)) {
      if (!reportByLastStage(frame, settings, data, callback)) {
        frame.clock.begin(Stage::report);
        report(frame, data, callback);
      }
      frame.result.report_ms = frame.clock.lap();
    } else {
      frame.clock.begin(Stage::report);
      reportWithoutMemory(frame, data, callback);
      frame.clock.lap();
    }
    frame.result.total_ms = frame.clock.total();
    note(frame.result);
  }
  statistics_.endFrame();
}

// All stages up to the report. False where there is no memory for them.
bool Pipeline::findPairs(Frame& frame, const Settings& settings) try {
  const bool were_apart = std::exchange(candidates_apart_, false);
  if (were_apart) {
    events_.keep(frame.pairs);
    std::swap(frame.pairs, candidates_);
  }
  if (!findChanges(frame)) findAnew(frame);
  frame.clock.begin(Stage::filter);
  if (select(frame)) frame.result.filter_ms += frame.clock.lap();
  const bool kept = !were_apart && !candidates_apart_ && !frame.result.anew();
  frame.same = kept && store_.coherence.unchanged();
  tellEvents(frame, kept);
  frame.clock.begin(Stage::none);
  frame.result.pairs = frame.pairs.size();
  store_.complete = true;
  learn(frame, settings);
  note(frame.result);
  if (watcher_ && !frame.facts.for_contacts && !frame.scene.nested && watcher_->isDue())
    showPairs(frame);
  return true;
} catch (const std::bad_alloc&) {
  if (events_.on() && !frame.scene.nested) events_.tellNothing();
  return false;
}

// The last frame's pairs, but for those of geoms that changed since. False where little is kept.
bool Pipeline::findChanges(Frame& frame) {
  const Plan& plan = frame.plan;
  FrameResult& result = frame.result;
  PairKeeper& coherence = store_.coherence;
  if (!plan.keep) return false;
  frame.clock.begin(Stage::update);
  result.coherence = coherence.update(frame.geoms(), frame.slots(), plan.rules, plan.threads,
                                      geom_update_, boxes_);
  const GeomUpdate::Untold& untold = coherence.untold();
  if (untold.count) complaints_.ofUntold(frame.geoms()[untold.first], untold.count);
  if (result.coherence != PairKeeper::Outcome::kept) return false;
  frame.scene.needs_clean = false;
  result.update_ms = frame.clock.lap();
  // Where nothing changed these stages are shorter than reading the clock.
  const bool timed = !coherence.unchanged();
  frame.clock.begin(Stage::synchronise);
  frame.updated = &geom_update_.facts();
  takeNotice(frame);
  if (timed) result.synchronise_ms = frame.clock.lap();
  frame.clock.begin(Stage::extract);
  result.threads = coherence.find(frame.geoms(), geom_update_, boxes_, plan.threads,
                                  {extraction_.finders(), pair_filter_}, frame.pairs);
  events_.keep(coherence.replaced());
  result.found.method = dParallelSAPMethodSweep;
  result.candidates = coherence.candidates();
  result.kept = coherence.kept();
  if (timed) result.extract_ms = frame.clock.lap();
  return true;
}

// update -> synchronise -> extract -> filter, for all geoms.
void Pipeline::findAnew(Frame& frame) {
  const Plan& plan = frame.plan;
  FrameResult& result = frame.result;
  PairKeeper& coherence = store_.coherence;
  frame.clock.begin(Stage::update);
  coherence.stop();
  events_.keep(frame.pairs);
  result.threads =
      geom_update_.pack(frame.geoms(), frame.slots(), plan.rules, plan.threads, boxes_);
  coherence.forgetChanges();
  frame.scene.needs_clean = false;
  result.update_ms = frame.clock.lap();

  frame.clock.begin(Stage::synchronise);
  frame.updated = &geom_update_.synchronise(frame.geoms(), boxes_);
  takeNotice(frame);
  if (plan.keep) result.moved += coherence.movedInVain();
  result.wide = boxes_.wide;
  result.synchronise_ms = frame.clock.lap();

  frame.clock.begin(Stage::extract);
  extract(frame);
  if (result.found.too_long) complaints_.ofTooLong(*result.found.too_long);
  result.threads = std::max(result.threads, result.found.threads);
  result.candidates = frame.pairs.size();
  result.extract_ms = frame.clock.lap();

  frame.clock.begin(Stage::filter);
  pair_filter_.run(frame.geoms(), *frame.updated, plan.rules, boxes_, plan.threads, frame.pairs);
  result.filter_ms = frame.clock.lap();
  if (plan.keep)
    coherence.start(frame.slots(), result.found.devices > 0,
                    result.found.method == dParallelSAPMethodSweep && !result.byFatPairs());
}

// By kept pairs of fat boxes where these serve.
void Pipeline::extract(Frame& frame) {
  const Plan& plan = frame.plan;
  FrameResult& result = frame.result;
  FatPairs& fat_pairs = store_.fat_pairs;
  const auto sweep = [this]() -> Sweep<float>& { return extraction_.finders().narrow.sweep; };
  if (plan.fat_pairs && !boxes_.wide)
    result.fat_pairs = fat_pairs.look(boxes_, plan.threads, sweep());
  if (!result.byFatPairs()) {
    result.found = extraction_.find(boxes_, plan.extraction, frame.pairs);
    return;
  }
  result.found.threads = fat_pairs.find(boxes_, plan.threads, sweep(), frame.pairs);
  result.found.method = dParallelSAPMethodSweep;
  result.found.kept_cells = true;
  result.fat_candidates = fat_pairs.kept();
}

// Of the geoms, when their boxes are up to date.
void Pipeline::takeNotice(Frame& frame) {
  const UpdateFacts& updated = *frame.updated;
  for (const Slot slot : updated.newly_invalid) complaints_.ofInvalid(frame.geoms()[slot]);
  frame.result.moved = updated.moved;
  frame.result.disabled = updated.disabled;
  frame.result.invalid = updated.invalid;
  frame.result.unbounded = updated.unbounded;
  if (frame.plan.rules.cull_planes) plane_pairs_.take(frame.geoms(), boxes_);
}

// Makes the pairs that are to be reported out of those that may have to be, and keeps these apart
// where they are others: false where they are the same.
bool Pipeline::select(Frame& frame) {
  const PackRules& rules = frame.plan.rules;
  const int threads = frame.plan.threads;
  const bool planes_apart = rules.cull_planes && plane_pairs_.any();
  const bool verifying = PairFilter::needsVerifying(*frame.updated, rules);
  if (!planes_apart && !verifying) return false;
  candidates_apart_ = true;
  std::swap(frame.pairs, candidates_);  // `pairs` may be those of the last frame now
  if (verifying) {
    // The pairs but those of planes, which are put among them in the end.
    PairList& others = planes_apart ? others_ : frame.pairs;
    pair_filter_.verify(
        frame.geoms(),
        {rules.skip_static || rules.skip_asleep, frame.updated->user_classes, rules.tested_classes},
        threads, candidates_, others);
  }
  if (planes_apart)
    frame.result.candidates += plane_pairs_.addTo(
        verifying ? others_ : candidates_,
        {frame.geoms(), boxes_, rules, frame.updated->user_classes}, threads, frame.pairs);
  return true;
}

// The last resort: finds and reports at once.
void Pipeline::reportWithoutMemory(Frame& frame, void* data, dNearCallback* callback) {
  complaints_.ofNoMemory();
  updateWithoutMemory(frame.scene, frame.result);
  note(frame.result);
  collideWithoutMemory(frame.scene, frame.plan.rules, frame.result, data, callback);
}

void Pipeline::report(const Frame& frame, void* data, dNearCallback* callback) {
  dxGeom* const* const geoms = frame.geoms();
  const GeomsAhead ahead(geoms);
  for (const Buffer<Pair>& part : frame.pairs.parts)
    ahead.tell(part.begin(), part.end(),
               [=](Pair pair) { callback(data, geoms[earlierOf(pair)], geoms[laterOf(pair)]); });
}

// False where it leaves that to the frame. It may collide a part of the pairs, as if it were all.
bool Pipeline::reportByLastStage(Frame& frame, const Settings& settings, void* data,
                                 dNearCallback* callback) {
  if (!last_stage_ || frame.scene.nested) return false;
  FrameResult& result = frame.result;
  frame.clock.begin(Stage::narrow);
  const LastStage::Pairs pairs = {frame.pairs,          frame.geoms(),
                                  frame.slots(),        frame.plan.contact_threads,
                                  threadsFor(settings), frame.plan.leave_out};
  LastStage::Collided collided;
  if (!last_stage_->prepare(pairs, collided)) return false;
  result.narrow_ms = frame.clock.lap();
  if (collided.pairs) {
    result.narrow_threads = collided.threads;
    result.contacts = collided.contacts;
    result.apart = collided.apart.apart;
    const std::size_t all = frame.pairs.size();
    const double part = static_cast<double>(collided.pairs) / static_cast<double>(all);
    policy_.learnOfBatch(settings,
                         {Batch::contacts, collided.threads, all, result.narrow_ms / part});
    policy_.learnOfApart(frame.plan, collided.apart);
    note(result);  // should the callback throw, or collide again
  }
  frame.clock.begin(Stage::report);
  last_stage_->report(pairs, data, callback);
  return true;
}

void Pipeline::showPairs(const Frame& frame) const {
  for (const Buffer<Pair>& part : frame.pairs.parts)
    for (const Pair pair : part)
      watcher_->see(frame.geoms()[earlierOf(pair)], frame.geoms()[laterOf(pair)],
                    PairWatcher::unknown);
  watcher_->endPairs();
}

}  // namespace ode_parallel_sap
