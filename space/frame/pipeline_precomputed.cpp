// dSpaceCollide under the preload library: the contacts for which the near callback will ask
// dCollide are found before the report.

#include "space/frame/geoms_ahead.h"
#include "space/frame/pipeline.h"

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

void Pipeline::precompute(Frame& frame, const Settings& settings, bool manual_cleanup) {
  const Plan& plan = frame.plan;
  FrameResult& result = frame.result;
  constexpr std::size_t sample = 16;  // fixed: so small a part costs next to nothing
  const NarrowPhase::Way way = {plan.contact_threads, manual_cleanup, plan.leave_out, true,
                                plan.precompute.in_full ? 1 : sample};
  frame.clock.begin(Stage::narrow);
  const int used = precomputed_.precompute(frame.pairs, {frame.geoms(), frame.slots()},
                                           plan.precompute.least_share, way);
  result.narrow_ms = frame.clock.lap();
  if (precomputed_.last().precomputed == 0) return;
  result.narrow_threads = used;
  result.contacts = precomputed_.narrowPhase().contacts();
  result.apart = precomputed_.narrowPhase().leftOut().apart;
  // As if it were all pairs, of which this is a part.
  const std::size_t pairs = frame.pairs.size();
  const double part =
      static_cast<double>(precomputed_.last().precomputed) / static_cast<double>(pairs);
  policy_.learnOfBatch(settings, {Batch::contacts, used, pairs, result.narrow_ms / part});
  policy_.learnOfApart(plan, precomputed_.narrowPhase().leftOut());
  note(result);  // should the callback throw, or collide again
}

void Pipeline::reportWatched(Frame& frame, const Settings& settings, void* data,
                             dNearCallback* callback) {
  dxGeom* const* const geoms = frame.geoms();
  frame.clock.begin(Stage::report);
  PrecomputedContacts::Report report(precomputed_);
  const AtEnd learning([&] {
    const bool more = precomputed_.wouldTellAny(frame.plan.precompute.least_share);
    if (!policy_.learnOfPrecomputing(frame.plan, frame.facts, settings, precomputed_.last(), more))
      precomputed_.forgetHabits();
  });
  const auto tell = [&](Pair pair) {
    dxGeom *const a = geoms[earlierOf(pair)], *const b = geoms[laterOf(pair)];
    report.next(pair, a, b);
    callback(data, a, b);
  };
  const GeomsAhead ahead(geoms);
  for (const Buffer<Pair>& part : frame.pairs.parts) ahead.tell(part.begin(), part.end(), tell);
}

}  // namespace ode_parallel_sap
