// What a pipeline knows when a frame begins, and what it takes from one.
#include <new>

#include "space/frame/pipeline.h"
#include "space/geom/user_classes.h"

namespace ode_parallel_sap {

SceneFacts Pipeline::factsOf(const Scene& scene, bool for_contacts) const {
  SceneFacts facts = {scene.slots.size(), last_pairs_,  boxes_.wide,
                      scene.nested,       for_contacts, extraction_.devices().devices()};
  facts.tested_classes = testedClasses();
  return facts;
}

void Pipeline::learn(const Frame& frame, const Settings& settings) {
  policy_.learn(frame.plan, frame.facts, settings, frame.result);
  if (frame.result.fat_pairs == FatPairs::Outcome::not_tried) store_.fat_pairs.passOver();
  if (!frame.plan.weighs_devices) return;
  DeviceBackend& devices = extraction_.devices();
  devices.reportLeftOut();
  if (devices.takeLoss()) policy_.learnOfLoss(devices.devices().usable);
  const int wanted = policy_.learnMissedDevices(frame.plan, factsOf(frame.scene, false), settings);
  if (wanted > 0) devices.prepare(wanted);
}

void Pipeline::note(const FrameResult& result) {
  statistics_.note(result);
  last_pairs_ = result.pairs;
}

FrameCounts Pipeline::collideSmall(const Scene& scene, const Settings& settings,
                                   const SmallReport& report, PairWatcher* watcher) {
  store_.coherence.stop();
  SmallReport told = report;
  if (watcher && !scene.nested && watcher->isDue()) told.watcher = watcher;
  if (events_.on() && scene.nested)
    events_.passOver();
  else if (events_.on())
    told.events = &events_;
  const FrameCounts result =
      small_scenes_.collide(scene, settings.rules, complaints_, statistics_, told);
  last_pairs_ = result.pairs;
  return result;
}

void Pipeline::clean(const Scene& scene, const Settings& settings) {
  try {
    geom_update_.clean(scene.slots.data(), scene.slots.size(),
                       policy_.teamFor(scene.slots.size(), settings), store_.changed());
  } catch (const std::bad_alloc&) {
    cleanOneByOne(scene.first);
  }
  scene.needs_clean = false;
}

void Pipeline::release(int part, FrameLists& lists) {
  store_.complete = false;
  switch (part) {
    case 0:
      events_.keep(lists.pairs);
      lists.release();
      candidates_ = PairList();
      others_ = PairList();
      candidates_apart_ = false;
      break;
    case 1:
      store_ = FrameStore();
      break;
    case 2:
      geom_update_ = GeomUpdate();
      boxes_ = BoxSet();
      break;
    case 3:
      extraction_.release();
      store_.fat_pairs = FatPairs();  // which goes on from its trees
      break;
    default:
      pair_filter_ = PairFilter();
      plane_pairs_ = PlanePairs();
      events_.release();
      if (last_stage_) last_stage_->release();
  }
}

std::size_t Pipeline::bytes() const {
  return bytesOf(store_.coherence, store_.fat_pairs, geom_update_, boxes_, extraction_,
                 pair_filter_, plane_pairs_, candidates_, others_, events_, last_stage_,
                 small_scenes_);
}

}  // namespace ode_parallel_sap
