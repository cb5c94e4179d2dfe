// dParallelSAPSpaceCollideContacts: the narrow phase in the place of the report.
#include <new>

#include "space/frame/pipeline.h"

namespace ode_parallel_sap {

void Pipeline::collideContacts(const Scene& scene, FrameLists& lists, const Settings& settings,
                               const ContactRequest& request, bool manual_cleanup) {
  statistics_.beginFrame();
  StageClock clock;
  ContactPairs pairs(request, lists.contact_pairs);
  NarrowPhase& narrow_phase = lists.narrow_phase;
  FrameResult result;
  const Plan plan = collectPairs(scene, lists, settings, pairs, result);
  clock.lap();
  clock.begin(Stage::narrow);
  bool found = true;
  try {
    const int used = narrow_phase.run(pairs.list(), request,
                                      {plan.contact_threads, manual_cleanup, plan.leave_out});
    result.narrow_threads = used;
    result.contacts = narrow_phase.contacts();
    result.apart = narrow_phase.apart().apart;
    result.narrow_ms = clock.lap();
    policy_.learnOfBatch(settings, {Batch::contacts, used, pairs.list().size(), result.narrow_ms});
    policy_.learnOfApart(plan, narrow_phase.apart());
    if (watcher_ && !scene.nested && watcher_->isDue())
      for (std::size_t place = 0; place < pairs.list().size(); ++place) {
        const dParallelSAPPair& pair = pairs.list()[place];
        const int contacts = narrow_phase.contactsOf(place);
        watcher_->see(pair.o1, pair.o2, contacts < 0 ? PairWatcher::unwanted : contacts);
      }
  } catch (const std::bad_alloc&) {
    narrow_phase = NarrowPhase();  // going on one by one needs memory, too
    found = false;
    result.narrow_threads = 1;
    result.narrow_ms = clock.lap();
  }
  clock.begin(Stage::report);
  note(result);  // should a contact callback throw, or collide again
  if (found)
    narrow_phase.report(pairs.list(), request);
  else
    NarrowPhase::collideOneByOne(pairs.list(), request);
  result.report_ms = clock.lap();
  result.total_ms = clock.total();
  note(result);
  statistics_.endFrame();
}

// All stages up to the list of pairs. Returns the plan, for the narrow phase.
Plan Pipeline::collectPairs(const Scene& scene, FrameLists& lists, const Settings& settings,
                            ContactPairs& pairs, FrameResult& result) {
  const SceneFacts facts = factsOf(scene, true);
  const Plan plan = policy_.decide(facts, settings);
  if (Policy::isSmall(facts.slots, settings)) {
    StageClock clock;
    clock.begin(Stage::extract);
    result = resultOf(collideSmall(scene, settings, {&pairs, &dParallelSAPAddPair}, nullptr));
    result.extract_ms = clock.lap();
    return plan;
  }
  Frame frame(store_, lists, plan, facts, scene);
  if (findPairs(frame, settings))
    pairs.add(frame.pairs, frame.geoms(), frame.updated->spaces, plan.threads);
  else
    reportWithoutMemory(frame, &pairs, &dParallelSAPAddPair);
  result = frame.result;
  return plan;
}

}  // namespace ode_parallel_sap
