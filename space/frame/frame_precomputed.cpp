// dSpaceCollide under the preload library: the contacts for which the near callback will ask
// dCollide are found before the report.

#include "space/frame/geoms_ahead.h"
#include "space/frame/frame.h"

namespace ode_parallel_sap {

namespace {

// Calls what is to be done however a report ends.
template <class Work>
class AtEnd {
 public:
  explicit AtEnd(Work work) : work_(work) {}
  ~AtEnd() { work_(); }
  AtEnd(const AtEnd&) = delete;
  AtEnd& operator=(const AtEnd&) = delete;

 private:
  Work work_;
};

}  // namespace

void Pipeline::precompute(Frame& frame, const PairList& pairs) {
  const Plan& plan = frame.plan;
  constexpr std::size_t sample = 16;  // fixed: so small a part costs next to nothing
  const NarrowPhase::Way way = {plan.contact_threads, frame.call.manual_cleanup, plan.leave_out,
                                true, plan.precompute.in_full ? 1 : sample};
  frame.clock.begin(Stage::narrow);
  const int used = precomputed_.precompute(pairs, {frame.call.geoms(), frame.call.slots()},
                                           plan.precompute.least_share, way);
  frame.clock.pause();
  if (precomputed_.last().precomputed == 0) return;
  frame.stats.narrow_threads = used;
  frame.stats.contacts = precomputed_.narrowPhase().contacts();
  frame.stats.apart = precomputed_.narrowPhase().leftOut().apart;
  // As if it were all pairs, of which this is a part.
  const double part =
      static_cast<double>(precomputed_.last().precomputed) / static_cast<double>(pairs.size());
  policy_.learnOfBatch(frame.call.settings, {Batch::contacts, used, pairs.size(),
                                             frame.clock.of(Stage::narrow) / part});
  policy_.learnOfApart(plan, precomputed_.narrowPhase().leftOut());
  note(frame);  // should the callback throw, or collide again
}

void Pipeline::reportWatched(Frame& frame, const PairList& pairs, void* data,
                             dNearCallback* callback) {
  dxGeom* const* const geoms = frame.call.geoms();
  frame.clock.begin(Stage::report);
  PrecomputedContacts::Report report(precomputed_);
  const AtEnd learning([&] {
    const bool more = precomputed_.wouldTellAny(frame.plan.precompute.least_share);
    if (!policy_.learnOfPrecomputing(frame.plan, frame.facts, frame.call.settings,
                                     precomputed_.last(), more))
      precomputed_.forgetHabits();
  });
  const auto tell = [&](Pair pair) {
    dxGeom *const a = geoms[earlierOf(pair)], *const b = geoms[laterOf(pair)];
    report.next(pair, a, b);
    callback(data, a, b);
  };
  const GeomsAhead ahead(geoms);
  for (const Buffer<Pair>& part : pairs.parts) ahead.tell(part.begin(), part.end(), tell);
}

}  // namespace ode_parallel_sap
