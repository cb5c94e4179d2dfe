#include "space/frame/small_scenes.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <algorithm>
#include <iterator>
#include <new>

#include "space/base/mechanisms.h"
#include "space/base/tuning.h"
#include "space/frame/stage_clock.h"
#include "space/geoms/pair_rule.h"
#include "space/geoms/slots.h"

namespace ode_parallel_sap {

namespace {

// Brings the AABBs of all dirty geoms up to date. Returns their number. `others`: code of the
// program did it for some. Not inline: the loop needs all registers.
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

// A few pairs, which go into the list when there is no room for more.
class PlaceSink : public PairSink {
 public:
  explicit PlaceSink(PlacePair* list) : PairSink{few_, std::end(few_), flush}, list_(list) {}
  // The end of the list.
  PlacePair* finish() {
    for (const Pair* pair = few_; pair < next; ++pair)
      *list_++ = {static_cast<std::uint16_t>(earlierOf(*pair) << 8 | laterOf(*pair))};
    next = few_;
    return list_;
  }

 private:
  static void flush(PairSink& sink, std::size_t) { static_cast<PlaceSink&>(sink).finish(); }

  PlacePair* list_;
  Pair few_[2 * (small_scene_slots + group_size)];  // two rows
};

// Lists the pairs of geoms whose AABBs overlap, ascending, with vectors of the exact bounds.
// Returns their number. Not inline, as it would cost the scenes that do without some time.
__attribute__((noinline)) unsigned findByVectors(SmallLists& lists, unsigned count) {
  for (unsigned i = 0; i < count; ++i) {
    const unsigned lane = i % group_size;
    Group<dReal>& boxes = lists.boxes[i / group_size];
    for (int axis = 0; axis < 3; ++axis) {
      boxes.lower[axis][lane] = lists.active[i]->aabb[2 * axis];
      boxes.upper[axis][lane] = lists.active[i]->aabb[2 * axis + 1];
    }
    boxes.slot[lane] = i;
  }
  TreeView<dReal> view = {};
  view.levels[0] = lists.boxes.data();
  view.depth = 1;
  PlaceSink sink(lists.pairs.data());
  kernels<dReal>().trianglePairs(view, {count, 0, 1, count - std::size_t{2}, count}, true, sink);
  return static_cast<unsigned>(sink.finish() - lists.pairs.data());
}

#if defined(__SSE2__) && defined(dDOUBLE)
// Two boxes overlap on an axis if neither's lower bound is above the other's upper one. With the
// one as (lower, -upper) and the other as (upper, -lower) both are one comparison of two lanes. So
// a pair takes three of them and no branch, which a processor could not predict.
class FacingBox {
 public:
  FacingBox() = default;
  explicit FacingBox(const dxGeom* geom) {
    for (int axis = 0; axis < 3; ++axis) {
      const __m128d bounds = _mm_loadu_pd(geom->aabb + 2 * axis);
      lower_[axis] = _mm_xor_pd(bounds, _mm_set_pd(-0.0, 0));
      upper_[axis] = _mm_xor_pd(_mm_shuffle_pd(bounds, bounds, 1), _mm_set_pd(-0.0, 0));
    }
  }
  bool overlaps(const FacingBox& other) const {
    const auto apart = [&](int axis) { return _mm_cmpnle_pd(lower_[axis], other.upper_[axis]); };
    return _mm_movemask_pd(_mm_or_pd(_mm_or_pd(apart(0), apart(1)), apart(2))) == 0;
  }

 private:
  __m128d lower_[3], upper_[3];
};
#else
struct FacingBox {
  const dxGeom* geom = nullptr;

  bool overlaps(const FacingBox& other) const { return boxesOverlap(geom, other.geom); }
};
#endif

// The same for so few geoms that vectors of them do not pay.
unsigned findOneByOne(dxGeom* const* geoms, unsigned count, PlacePair* pairs) {
  FacingBox boxes[most_without_vectors];
  for (unsigned i = 0; i < count; ++i) boxes[i] = FacingBox{geoms[i]};
  std::size_t found = 0;
  for (unsigned i = 0; i + 1 < count; ++i) {
    const FacingBox box = boxes[i];
    for (unsigned j = i + 1; j < count; ++j) {
      pairs[found] = {static_cast<std::uint16_t>(i << 8 | j)};
      found += box.overlaps(boxes[j]);
    }
  }
  return static_cast<unsigned>(found);
}

// Whether an enabled geom takes part. Counts it if it is one of those that few scenes have.
__attribute__((noinline)) bool takesPart(const dxGeom* geom, SmallFound& found) {
  if (!isEnabled(geom)) return false;  // it is an empty sub-space
  if (hasNaN(geom)) {
    ++found.counts.invalid;
    return false;
  }
  if (isUnbounded(geom)) ++found.counts.unbounded;
  if (isUserClass(geom)) found.user_classes = true;
  return true;
}

// Lists the geoms that take part. All are clean. Returns whether some two may not meet by their
// bits or bodies: no bit is in all, or a geom is followed by another one of its body, as all but
// the last are. Needs exactMode().
inline bool listActive(dxGeom* first, dxGeom** active, SmallFound& found) {
  unsigned actives = 0;
  unsigned long shared_bits = ~0ul;
  bool followed = false;
  for (dxGeom* geom = first; geom; geom = geom->next) {
    if ((geom->gflags & GEOM_ENABLE_TEST_MASK) != GEOM_ENABLE_TEST_VALUE) continue;
    const bool usual = geom->type < dFirstSpaceClass && isPlain(geom);
    if (!usual && !takesPart(geom, found)) continue;
    active[actives++] = geom;
    shared_bits &= geom->category_bits & geom->collide_bits;
    followed |= geom->body_next != nullptr;
  }
  found.actives = actives;
  return !shared_bits || followed;
}

// Which of the geoms that take part may pair, the AABBTest functions apart. Needs exactMode().
inline unsigned listPairs(unsigned actives, const PairRule& rule, bool takes_all,
                          SmallLists& lists) {
  const unsigned overlapping = actives > most_without_vectors
                                   ? findByVectors(lists, actives)
                                   : findOneByOne(lists.active.data(), actives, lists.pairs.data());
  if (takes_all) return overlapping;
  unsigned pairs = 0;
  for (unsigned i = 0; i < overlapping; ++i) {
    const PlacePair pair = lists.pairs[i];
    if (rule.mayPair(lists.active[pair.earlier()], lists.active[pair.later()]))
      lists.pairs[pairs++] = pair;
  }
  return pairs;
}

// The geoms that take part, and the pairs, when all AABBs are up to date. Needs exactMode().
inline void findAmongClean(const Scene& scene, const PackRules& rules, SmallLists& lists,
                           SmallFound& found) {
  const bool by_filters = listActive(scene.first, lists.active.data(), found);
  const PairRule rule(rules);
  found.counts.geoms = static_cast<unsigned>(scene.count);
  found.counts.disabled = found.counts.geoms - found.actives - found.counts.invalid;
  found.counts.candidates = found.counts.pairs =
      listPairs(found.actives, rule, !by_filters && rule.isODEs(), lists);
}

__attribute__((noinline)) void findInExactMode(const Scene& scene, const PackRules& rules,
                                               SmallLists& lists, SmallFound& found) {
  const ScopedMode mode(exactMode());
  findAmongClean(scene, rules, lists, found);
}

// Brings all AABBs up to date and finds the pairs, the AABBTest functions apart. Reads the thread's
// floating-point mode first: reading it waits for all computations before. `found` is written
// member by member and not copied: a copy waits until words just written have reached the cache.
inline void find(const Scene& scene, const PackRules& rules, SmallLists& lists, SmallFound& found) {
  const bool is_exact = !differs(currentMode(), exactMode());
  bool others = false;
  found.counts.moved = clean(scene.first, others);
  scene.noteClean();
  if (is_exact && !others) return findAmongClean(scene, rules, lists, found);
  findInExactMode(scene, rules, lists, found);
}

// Leaves those of the pairs that pass the AABBTest functions.
void test(SmallLists& lists, SmallFound& found) {
  unsigned passed = 0;
  for (unsigned i = 0; i < found.counts.candidates; ++i) {
    const PlacePair pair = found.pairs[i];
    if (passesAABBTests(found.active[pair.earlier()], found.active[pair.later()]))
      lists.pairs[passed++] = pair;
  }
  found.pairs = lists.pairs.data();
  found.counts.pairs = passed;
}

void complainOfInvalid(dxGeom* first, Complaints& complaints) {
  for (dxGeom* geom = first; geom; geom = geom->next)
    if (isEnabled(geom) && hasNaN(geom)) complaints.ofInvalid(geom);
}

}  // namespace

bool SmallLists::grow(std::size_t geoms) try {
  const std::size_t cells =
      geoms > most_without_vectors ? (geoms + group_size - 1) / group_size : 0;
  pairs.resizeDiscarding(geoms * (geoms - 1) / 2);
  boxes.resizeDiscarding(cells);
  active.resizeDiscarding(geoms);  // at last: so many are ready
  return true;
} catch (const std::bad_alloc&) {
  active.release();
  return false;
}

FrameCounts SmallScenes::collide(const Scene& scene, const PackRules& rules, SmallLists& lists,
                                 Complaints& complaints, Statistics& statistics,
                                 const SmallReport& report) {
  const bool timed = statistics.beginSmallFrame();
  const Clock::time_point begin = timed ? Clock::now() : Clock::time_point();
  SmallFound found;
  if (isStill(rules)) {
    found = found_;
  } else {
    found.active = lists.active.data();
    found.pairs = lists.pairs.data();
    find(scene, rules, lists, found);
    noteFound(scene, rules, complaints, found);
  }
  if (found.user_classes) test(lists, found);
  if (report.events && !updateEvents(scene, found, *report.events)) complaints.ofUnreportedEvents();

  const unsigned long long frame = statistics.frames();
  statistics.noteSmall(found.counts);
  const Clock::time_point reporting = timed ? Clock::now() : begin;
  const auto forPairs = [&](auto use) {
    for (const PlacePair* pair = found.pairs; pair < found.pairs + found.counts.pairs; ++pair)
      use(found.active[pair->earlier()], found.active[pair->later()]);
  };
  if (report.watcher) {
    forPairs([&](dxGeom* a, dxGeom* b) { report.watcher->see(a, b); });
    report.watcher->endPairs();
  }
  const PairReceiver receiver = report.receiver;
  const Reports::Open open(scene.reports, receiver.opens);
  const std::size_t slots = scene.slots.size();
  const auto isThere = [&](const dxGeom* geom) {
    const auto end = scene.slots.begin() + slots;
    return std::find(scene.slots.begin(), end, geom) != end;
  };
  forPairs([&](dxGeom* a, dxGeom* b) {
    if (!scene.reports.changed() || (isThere(a) && isThere(b)))
      receiver.callback(receiver.data, a, b);
    else if (receiver.gap)
      receiver.gap(receiver.data);
  });
  if (receiver.end) receiver.end(receiver.data);
  if (statistics.frames() != frame)  // a collide within the callback wrote its own
    statistics.noteSmall(found.counts);
  if (timed)
    statistics.noteSmallTimes(milliseconds(begin, reporting),
                              milliseconds(reporting, Clock::now()));
  return found.counts;
}

bool SmallScenes::isStill(const PackRules& rules) const {
  if (!is_still_ || rules_ != rules) return false;
  Seen::Difference difference = 0;
  for (const Seen& seen : seen_) difference |= seen.difference();
  return difference == 0;
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
  if (found.recalled && !found.user_classes && events.updateSame(source)) return true;
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

// Not where rules leave out pairs by the state of bodies, which changes silently. Nor within a
// callback, to which the remembered pairs may be reported.
void SmallScenes::remember(const Scene& scene, const PackRules& rules, const SmallFound& found) {
  if (!mechanisms::still_small_scenes || rules.skip() || scene.nested) return;
  try {
    seen_.clear();
    for (const dxGeom* geom = scene.first; geom; geom = geom->next) seen_.push_back(Seen(geom));
    active_.assign(found.active, found.active + found.actives);
    pairs_.assign(found.pairs, found.pairs + found.counts.candidates);
  } catch (const std::bad_alloc&) {
    return;
  }
  rules_ = rules;
  found_ = found;
  found_.active = active_.data();
  found_.pairs = pairs_.data();
  found_.recalled = is_still_ = true;
}

}  // namespace ode_parallel_sap
