#include "space/frame/small_scenes.h"

#include <algorithm>
#include <new>

#include "space/data/mechanisms.h"
#include "space/frame/stage_clock.h"
#include "space/frame/tuning.h"
#include "space/geom/plane_test.h"
#include "space/geom/slots.h"
#include "space/simd/kernels.h"
#include "space/update/stock_bounds.h"

namespace ode_parallel_sap {

namespace {

// Brings the AABBs of all dirty geoms up to date. Returns their number.
std::size_t clean(dxGeom* first) {
  const StockBounds& stock = StockBounds::ofLoadedOde();
  std::size_t moved = 0;
  for (dxGeom* geom = first; geom; geom = geom->next) {
    if (!(geom->gflags & GEOM_DIRTY)) continue;
    if (stock.knows(geom))
      StockBounds::clean(geom);
    else
      cleanGeom(geom);
    ++moved;
  }
  return moved;
}

// Calls use(i, j), i < j, for those of the geoms whose AABBs overlap, ascending: with vectors of
// the exact bounds. Needs exactMode(). Not inline, as it would cost those that do without some
// time.
template <class Use>
__attribute__((noinline)) void forOverlapping(dxGeom* const* geoms, unsigned count, Use use) {
  constexpr std::size_t cells = (smallest_scene + group_size - 1) / group_size;
  Group<dReal> boxes[cells];
  GroupIds ids[cells];
  for (unsigned i = 0; i < count; ++i) {
    const unsigned lane = i % group_size;
    for (int axis = 0; axis < 3; ++axis) {
      boxes[i / group_size].lower[axis][lane] = geoms[i]->aabb[2 * axis];
      boxes[i / group_size].upper[axis][lane] = geoms[i]->aabb[2 * axis + 1];
    }
    ids[i / group_size].slot[lane] = i;
  }
  TreeView<dReal> view = {};
  view.levels[0] = boxes;
  view.ids = ids;
  view.depth = 1;
  // A few rows at a time, which need less of the stack.
  constexpr std::size_t rows = group_size;
  Pair pairs[(rows + 1) * smallest_scene + 2 * group_size];
  for (std::size_t row = 0; row + 1 < count; row += rows) {
    PairSink sink = {pairs, pairs + sizeof pairs / sizeof *pairs, nullptr};  // there is room
    const std::size_t last = std::min<std::size_t>(row + rows - 1, count - 2);
    kernels<dReal>().trianglePairs(view, {count, row, row + 1, last, count}, true, sink);
    for (const Pair* pair = pairs; pair < sink.next; ++pair) use(earlierOf(*pair), laterOf(*pair));
  }
}

// Which geoms take part, and which of them may pair, the AABBTest functions apart. All are clean.
void find(const Scene& scene, const PackRules& rules, SmallScene& found) {
  const ScopedMode mode(exactMode());
  for (dxGeom* geom = scene.first; geom; geom = geom->next) {
    if (!isEnabled(geom)) continue;
    if (!isPlain(geom)) {
      if (hasNaN(geom)) {
        ++found.invalid;
        continue;
      }
      found.unbounded += isUnbounded(geom);
    }
    found.user_classes = found.user_classes || isUserClass(geom);
    found.active[found.actives++] = geom;
  }
  const bool all_wanted = !rules.skip() && !rules.cull_planes;
  const auto take = [&](unsigned i, unsigned j) {
    dxGeom *const a = found.active[i], *const b = found.active[j];
    if (filtersMatch(a, b) && (all_wanted || !(rules.cull_planes && areClearByPlane(a, b))) &&
        (all_wanted || !isLeftOut(a, b, rules)))
      found.index_pairs[found.candidates++] = {static_cast<std::uint16_t>(i << 8 | j)};
  };
  if (found.actives > most_without_vectors)
    forOverlapping(found.active, found.actives, take);
  else
    for (unsigned i = 0; i < found.actives; ++i)
      for (unsigned j = i + 1; j < found.actives; ++j)
        if (boxesOverlap(found.active[i], found.active[j])) take(i, j);
}

// Leaves the index_pairs that pass the AABBTest functions as the pairs.
void test(SmallScene& found) {
  if (!found.user_classes) {
    found.pairs = found.candidates;
    return;
  }
  for (std::size_t i = 0; i < found.candidates; ++i) {
    const SmallScene::IndexPair index_pair = found.index_pairs[i];
    if (passesAABBTests(found.active[index_pair.earlier()], found.active[index_pair.later()]))
      found.index_pairs[found.pairs++] = index_pair;
  }
}

}  // namespace

SmallResult SmallScenes::collide(const Scene& scene, const PackRules& rules, Complaints& complaints,
                                 Statistics& statistics, const SmallReport& report) {
  const bool timed = statistics.beginSmallFrame();
  const Clock::time_point begin = timed ? Clock::now() : Clock::time_point();
  SmallScene found;
  if (is_still_ && still_scene_->holds(scene.first, rules)) {
    still_scene_->recall(found);
  } else {
    found.moved = clean(scene.first);
    scene.needs_clean = false;
    find(scene, rules, found);
    for (dxGeom* geom = scene.first; found.invalid && geom; geom = geom->next)
      if (isEnabled(geom) && hasNaN(geom)) complaints.ofInvalid(geom);
    is_still_ = false;
    // The second of two frames without a move is remembered.
    still_frames_ = found.moved == 0 ? still_frames_ + 1 : 0;
    if (still_frames_ >= 2) remember(scene, rules, found);
  }
  test(found);
  if (report.events && !tell(scene, found, *report.events)) complaints.ofUnreportedEvents();

  const unsigned long long frame = statistics.frames();
  const SmallResult result = found.result(scene.count);
  statistics.note(result);
  const Clock::time_point reporting = timed ? Clock::now() : begin;
  std::size_t reported = 0;
  if (statistics.sample().on() && report.sampled && !statistics.sample().passOver(found.pairs))
    reported = reportSampled(found, report, statistics.sample());
  for (; reported < found.pairs; ++reported) {
    const SmallScene::IndexPair index_pair = found.index_pairs[reported];
    report.callback(report.data, found.active[index_pair.earlier()],
                    found.active[index_pair.later()]);
  }
  if (report.end) report.end(report.data);
  if (statistics.frames() != frame)  // a collide within the callback wrote its own
    statistics.note(result);
  if (timed)
    statistics.noteTimes(milliseconds(begin, reporting), milliseconds(reporting, Clock::now()));
  return result;
}

// Up to the last pair that is picked. Not inline, as it would cost those that do without some time.
__attribute__((noinline)) std::size_t SmallScenes::reportSampled(const SmallScene& found,
                                                                 const SmallReport& report,
                                                                 PairSample& sample) {
  std::size_t reported = 0;
  const auto tell = [&] {
    const SmallScene::IndexPair index_pair = found.index_pairs[reported++];
    report.callback(report.data, found.active[index_pair.earlier()],
                    found.active[index_pair.later()]);
  };
  sample.pick(found.pairs, [&](std::size_t place) {
    while (reported < place) tell();
    const SmallScene::IndexPair index_pair = found.index_pairs[reported];
    sample.time(found.active[index_pair.earlier()], found.active[index_pair.later()],
                PairSample::not_asked, tell);
  });
  return reported;
}

// False without memory for it. AABBTest functions may answer otherwise in a scene that is still.
bool SmallScenes::tell(const Scene& scene, const SmallScene& found, PairEvents& events) {
  constexpr PairEvents::Source source = PairEvents::Source::small_scene;
  if (found.recalled && !found.user_classes && events.tellSame(source)) return true;
  try {
    event_pairs_.clear(1);
    Buffer<Pair>& pairs = event_pairs_.parts[0];
    pairs.resizeDiscarding(found.pairs);
    for (std::size_t i = 0; i < pairs.size(); ++i)
      pairs[i] = makePair(Slots::slotOf(found.active[found.index_pairs[i].earlier()]),
                          Slots::slotOf(found.active[found.index_pairs[i].later()]));
  } catch (const std::bad_alloc&) {
    events.tellNothing();
    return false;
  }
  return events.tell(event_pairs_, scene.slots, source, 1);
}

// Where a frame says it all: not what rules leave out by the state of bodies.
void SmallScenes::remember(const Scene& scene, const PackRules& rules, const SmallScene& found) {
  if (!mechanisms::still_small_scenes || rules.skip()) return;
  try {
    if (!still_scene_) still_scene_ = std::make_unique<StillScene>();
    still_scene_->remember(scene.first, rules, found);
    is_still_ = true;
  } catch (const std::bad_alloc&) {
  }
}

}  // namespace ode_parallel_sap
