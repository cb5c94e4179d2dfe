#include "space/frame/small_scenes.h"

#include <algorithm>
#include <new>

#include "space/base/mechanisms.h"
#include "space/frame/stage_clock.h"
#include "space/frame/tuning.h"
#include "space/geoms/facing_box.h"
#include "space/geoms/pair_rule.h"
#include "space/geoms/slots.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

// Brings the AABBs of all dirty geoms up to date. Returns their number. `others`: code of the
// program did it for some. Not inline, so that the loop has the registers for itself.
__attribute__((noinline)) unsigned clean(dxGeom* first, bool& others) {
  unsigned moved = 0;
  for (dxGeom* geom = first; geom; geom = geom->next) {
    if (!(geom->gflags & GEOM_DIRTY)) continue;
    ++moved;
    others = others || needsCallingThread(geom);
    cleanGeom(geom);
  }
  return moved;
}

// Calls use(pair) for those of the geoms whose AABBs overlap, ascending: with vectors of
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
    for (const Pair* pair = pairs; pair < sink.next; ++pair)
      use(PlacePair{static_cast<std::uint16_t>(earlierOf(*pair) << 8 | laterOf(*pair))});
  }
}

// The same for so few geoms that vectors of them do not pay. Returns the number of pairs.
unsigned findOverlapping(dxGeom* const* geoms, unsigned count, PlacePair* pairs) {
  FacingBox boxes[most_without_vectors];
  for (unsigned i = 0; i < count; ++i) boxes[i] = FacingBox(geoms[i]);
  std::size_t found = 0;
  for (unsigned i = 0; i + 1 < count; ++i) {
    const FacingBox::Turned box(boxes[i]);
    for (unsigned j = i + 1; j < count; ++j) {
      pairs[found] = {static_cast<std::uint16_t>(i << 8 | j)};
      found += box.overlaps(boxes[j]);
    }
  }
  return static_cast<unsigned>(found);
}

enum class Bounds { usual, unbounded, invalid };

__attribute__((noinline)) Bounds boundsOf(const dxGeom* geom) {
  if (hasNaN(geom)) return Bounds::invalid;
  return isUnbounded(geom) ? Bounds::unbounded : Bounds::usual;
}

// Whether an enabled geom takes part. Counts it if it is one of those that few scenes have.
__attribute__((noinline)) bool takesPart(const dxGeom* geom, SmallCounts& counts) {
  if (!isEnabled(geom)) return false;  // it is an empty sub-space
  const Bounds bounds = boundsOf(geom);
  if (bounds == Bounds::invalid) {
    ++counts.invalid;
    return false;
  }
  if (bounds == Bounds::unbounded) ++counts.unbounded;
  if (isUserClass(geom)) counts.user_classes = true;
  return true;
}

// Lists the geoms that take part. All are clean. Returns whether some two may not meet by their
// bits or bodies: no bit is in all, or a geom is followed by another one of its body, as all but
// the last are. Needs exactMode().
inline bool listActive(dxGeom* first, dxGeom** active, SmallCounts& counts) {
  unsigned actives = 0;
  unsigned long shared_bits = ~0ul;
  bool followed = false;
  for (dxGeom* geom = first; geom; geom = geom->next) {
    if ((geom->gflags & GEOM_ENABLE_TEST_MASK) != GEOM_ENABLE_TEST_VALUE) continue;
    const bool usual = geom->type < dFirstSpaceClass && isPlain(geom);
    if (!usual && !takesPart(geom, counts)) continue;
    active[actives++] = geom;
    shared_bits &= geom->category_bits & geom->collide_bits;
    followed |= geom->body_next != nullptr;
  }
  counts.actives = actives;
  return !shared_bits || followed;
}

// What decides, beside their AABBs, which geoms that take part may pair.
struct Choice {
  PairRule rule;
  bool takes_all;

  // Not inline, as most scenes take all.
  __attribute__((noinline)) bool mayPair(dxGeom* a, dxGeom* b) const { return rule.mayPair(a, b); }
  bool takes(dxGeom* a, dxGeom* b) const { return takes_all || mayPair(a, b); }
};

__attribute__((noinline)) unsigned listPairsOfMany(unsigned actives, const Choice& choice,
                                                   SmallStorage& storage) {
  unsigned pairs = 0;
  forOverlapping(storage.active, actives, [&](PlacePair pair) {
    if (choice.takes(storage.active[pair.earlier()], storage.active[pair.later()]))
      storage.pairs[pairs++] = pair;
  });
  return pairs;
}

inline unsigned listPairsOfSome(unsigned actives, const Choice& choice, SmallStorage& storage) {
  const unsigned overlapping = findOverlapping(storage.active, actives, storage.pairs);
  if (choice.takes_all) return overlapping;
  unsigned pairs = 0;
  for (unsigned i = 0; i < overlapping; ++i) {
    const PlacePair pair = storage.pairs[i];
    if (choice.takes(storage.active[pair.earlier()], storage.active[pair.later()]))
      storage.pairs[pairs++] = pair;
  }
  return pairs;
}

// Which of them may pair, the AABBTest functions apart. Needs exactMode().
inline unsigned listPairs(unsigned actives, const Choice& choice, SmallStorage& storage) {
  return actives > most_without_vectors ? listPairsOfMany(actives, choice, storage)
                                        : listPairsOfSome(actives, choice, storage);
}

// The geoms that take part, and the pairs, when all AABBs are up to date. Needs exactMode().
inline void findAmongClean(const Scene& scene, const PackRules& rules, SmallStorage& storage,
                           SmallCounts& counts) {
  const bool by_filters = listActive(scene.first, storage.active, counts);
  const PairRule rule(rules);
  counts.candidates = counts.pairs =
      listPairs(counts.actives, {rule, !by_filters && rule.isODEs()}, storage);
}

__attribute__((noinline)) void findInExactMode(const Scene& scene, const PackRules& rules,
                                               SmallStorage& storage, SmallCounts& counts) {
  const ScopedMode mode(exactMode());
  findAmongClean(scene, rules, storage, counts);
}

// Brings all AABBs up to date and finds the pairs, the AABBTest functions apart. Reads the thread's
// floating-point mode first: reading it waits for all computations before. `counts` is written
// member by member and never copied: a copy waits until words just written have reached the cache.
inline void find(const Scene& scene, const PackRules& rules, SmallStorage& storage,
                 SmallCounts& counts) {
  const bool is_exact = !differs(currentMode(), exactMode());
  bool others = false;
  counts.moved = clean(scene.first, others);
  scene.needs_clean = false;
  if (is_exact && !others) return findAmongClean(scene, rules, storage, counts);
  findInExactMode(scene, rules, storage, counts);
}

// Leaves those of the pairs that pass the AABBTest functions.
void test(SmallStorage& storage, SmallFound& found) {
  unsigned passed = 0;
  for (unsigned i = 0; i < found.counts.candidates; ++i) {
    const PlacePair pair = found.pairs[i];
    if (passesAABBTests(found.active[pair.earlier()], found.active[pair.later()]))
      storage.pairs[passed++] = pair;
  }
  found.pairs = storage.pairs;
  found.counts.pairs = passed;
}

void complainOfInvalid(dxGeom* first, Complaints& complaints) {
  const auto isInvalid = [](const dxGeom* geom) {
    const ScopedMode mode(exactMode());  // where a signalling NaN raises nothing
    return isEnabled(geom) && boundsOf(geom) == Bounds::invalid;  // a call, within the mode
  };
  for (dxGeom* geom = first; geom; geom = geom->next)
    if (isInvalid(geom)) complaints.ofInvalid(geom);
}

}  // namespace

FrameCounts SmallScenes::collide(const Scene& scene, const PackRules& rules, Complaints& complaints,
                                 Statistics& statistics, const SmallReport& report) {
  const bool timed = statistics.beginSmallFrame();
  const Clock::time_point begin = timed ? Clock::now() : Clock::time_point();
  SmallStorage storage;
  SmallFound found(storage);
  if (isStill(rules)) {
    found = still_scene_->found();
  } else {
    find(scene, rules, storage, found.counts);
    noteFound(scene, rules, complaints, found);
  }
  if (found.counts.user_classes) test(storage, found);
  if (report.events && !updateEvents(scene, found, *report.events)) complaints.ofUnreportedEvents();

  const unsigned long long frame = statistics.frames();
  const FrameCounts result = found.counts.of(scene.count);
  statistics.noteSmall(result);
  const Clock::time_point reporting = timed ? Clock::now() : begin;
  const auto forPairs = [&](auto use) {
    for (const PlacePair* pair = found.pairs; pair < found.pairs + result.pairs; ++pair)
      use(found.active[pair->earlier()], found.active[pair->later()]);
  };
  if (report.watcher) {
    forPairs([&](dxGeom* a, dxGeom* b) { report.watcher->see(a, b, PairWatcher::unknown); });
    report.watcher->endPairs();
  }
  forPairs([&](dxGeom* a, dxGeom* b) { report.callback(report.data, a, b); });
  if (report.end) report.end(report.data);
  if (statistics.frames() != frame)  // a collide within the callback wrote its own
    statistics.noteSmall(result);
  if (timed)
    statistics.noteSmallTimes(milliseconds(begin, reporting),
                              milliseconds(reporting, Clock::now()));
  return result;
}

// Of a frame that was found anew.
void SmallScenes::noteFound(const Scene& scene, const PackRules& rules, Complaints& complaints,
                            const SmallFound& found) {
  if (found.counts.invalid) complainOfInvalid(scene.first, complaints);
  is_still_ = false;
  // The second of two frames without a move is remembered.
  still_frames_ = found.counts.moved == 0 ? still_frames_ + 1 : 0;
  if (still_frames_ >= 2) remember(scene, rules, found);
}

// False without memory for it. AABBTest functions may answer otherwise in a scene that is still.
bool SmallScenes::updateEvents(const Scene& scene, const SmallFound& found, PairEvents& events) {
  constexpr PairEvents::Source source = PairEvents::Source::small_scene;
  if (found.recalled && !found.counts.user_classes && events.updateSame(source)) return true;
  try {
    event_pairs_.clear(1);
    Buffer<Pair>& pairs = event_pairs_.parts[0];
    pairs.resizeDiscarding(found.counts.pairs);
    for (std::size_t i = 0; i < pairs.size(); ++i)
      pairs[i] = makePair(Slots::slotOf(found.active[found.pairs[i].earlier()]),
                          Slots::slotOf(found.active[found.pairs[i].later()]));
  } catch (const std::bad_alloc&) {
    events.updateUnknown();
    return false;
  }
  return events.update(event_pairs_, scene.slots, source, 1);
}

// Where a frame says it all: not what rules leave out by the state of bodies. Nor within a
// callback, to which the remembered pairs may be reported.
void SmallScenes::remember(const Scene& scene, const PackRules& rules, const SmallFound& found) {
  if (!mechanisms::still_small_scenes || rules.skip() || scene.nested) return;
  try {
    if (!still_scene_) still_scene_ = std::make_unique<StillScene>();
    still_scene_->remember(scene, rules, found);
    is_still_ = true;
  } catch (const std::bad_alloc&) {
  }
}

void StillScene::remember(const Scene& scene, const PackRules& rules, const SmallFound& found) {
  rules_ = rules;
  seen_.clear();
  for (const dxGeom* geom = scene.first; geom; geom = geom->next) seen_.push_back(Seen(geom));
  active_.assign(found.active, found.active + found.counts.actives);
  pairs_.assign(found.pairs, found.pairs + found.counts.candidates);
  found_.active = active_.data();
  found_.pairs = pairs_.data();
  found_.counts = found.counts;
  found_.recalled = true;
}

}  // namespace ode_parallel_sap
