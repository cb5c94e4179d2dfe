// Pairs in bulk: dParallelSAPSpaceCollidePairs, with blocks of pairs in the place of the report,
// and which pairs began and ended.
#include "space/frame/pair_blocks.h"
#include "space/frame/pipeline.h"

namespace ode_parallel_sap {

void Pipeline::collidePairs(const Scene& scene, FrameLists& lists, const Settings& settings,
                            const PairsRequest& request) {
  if (!request.callback && repeatsLastFrame() && statistics_.repeatFrame()) return;
  statistics_.beginFrame();
  if (Policy::isSmall(scene.slots.size(), settings)) {
    PairBlock block(request);
    const auto finish = [](void* own) { static_cast<PairBlock*>(own)->finish(); };
    collideSmall(scene, settings, {&block, &PairBlock::add, finish}, watcher_);
  } else {
    SceneFacts facts = factsOf(scene, false);
    facts.for_blocks = request.concurrent();
    Frame frame(store_, lists, policy_.decide(facts, settings), facts, scene);
    if (findPairs(frame, settings)) {
      frame.clock.begin(Stage::report);
      const int used = handOutBlocks(frame.pairs, frame.geoms(), request, frame.plan.block_threads);
      frame.result.block_threads = used;
      frame.result.report_ms = frame.clock.lap();
      store_.repeats = frame.same && !request.callback;
      if (request.concurrent())
        policy_.learnOfBatch(settings,
                             {Batch::blocks, used, frame.pairs.size(), frame.result.report_ms});
    } else {
      PairBlock block(request);
      reportWithoutMemory(frame, &block, &PairBlock::add);
      block.finish();
      frame.clock.lap();
    }
    frame.result.total_ms = frame.clock.total();
    note(frame.result);
  }
  statistics_.endFrame();
}

// Frames within a callback have no events.
void Pipeline::updateEvents(Frame& frame) {
  if (!events_.on()) return;
  if (frame.scene.nested) {
    events_.skip();
    return;
  }
  frame.clock.begin(Stage::events);
  constexpr PairEvents::Source source = PairEvents::Source::frame;
  if (frame.same && events_.updateSame(source)) return;
  if (!events_.update(frame.pairs, frame.scene.slots, source, frame.plan.threads))
    complaints_.ofUnreportedEvents();
  frame.same = false;
  frame.result.events_ms = frame.clock.lap();
}

}  // namespace ode_parallel_sap
