// Scenes so small that they need no boxes.

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <algorithm>
#include <limits>
#include <new>
#include <optional>
#include <utility>

#include "space/base/mechanisms.h"
#include "space/base/round_to_floats.h"
#include "space/frame/frame.h"
#include "space/geoms/pair_rule.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

namespace {

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
  }
  for (unsigned lane = count; lane % group_size; ++lane)
    lists.boxes[lane / group_size].lower[0][lane % group_size] =
        std::numeric_limits<dReal>::quiet_NaN();
  const std::size_t cells = groupsFor(count);
  const Kernels<dReal>& kernel = kernels<dReal>();
  PlacePair* next = lists.pairs.data();
  std::uint32_t row[small_scene_slots + group_size];
  for (unsigned place = 0; place + 1 < count; ++place) {
    const std::size_t found = kernel.testLater(lists.boxes.data(), cells, place, row);
    for (std::size_t i = 0; i < found; ++i)
      *next++ = {static_cast<std::uint16_t>(place << 8 | row[i])};
  }
  return static_cast<unsigned>(next - lists.pairs.data());
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
__attribute__((noinline)) bool takesPart(const dxGeom* geom, SmallLists& lists,
                                         FrameCounts& counts) {
  if (!isEnabled(geom)) return false;  // it is an empty sub-space
  if (hasNaN(geom)) {
    ++counts.invalid;
    return false;
  }
  Box box;
  lists.unbounded += (roundToFloats(geom->aabb, box) & unbounded_bounds) != 0;
  if (isUserClass(geom)) lists.user_classes = true;
  return true;
}

// Lists the geoms that take part, or with `listed` returns whether they are those in the list,
// whose AABBs are as they were. All are clean. `by_filters`: some two may not meet by their bits or
// bodies: no bit is in all, or a geom is followed by another one of its body, as all but the last
// are. (A walk along ODE's list would wait for each geom.) Needs exactMode(), unless `listed`.
template <bool listed>
inline bool listActive(const Buffer<dxGeom*>& slots, SmallLists& lists, FrameCounts& counts,
                       bool& by_filters) {
  dxGeom** const active = lists.active.data();
  unsigned actives = 0;
  unsigned long shared_bits = ~0ul;
  bool followed = false;
  for (dxGeom* const geom : slots) {
    if (!geom || (geom->gflags & GEOM_ENABLE_TEST_MASK) != GEOM_ENABLE_TEST_VALUE) continue;
    const bool usual =
        listed ? active[actives] == geom : geom->type < dFirstSpaceClass && isPlain(geom);
    if (listed && !usual) return false;
    if (!usual && !takesPart(geom, lists, counts)) continue;
    active[actives++] = geom;
    shared_bits &= geom->category_bits & geom->collide_bits;
    followed |= geom->body_next != nullptr;
  }
  by_filters = !shared_bits || followed;
  return std::exchange(lists.actives, actives) == actives;
}

// Has pairs left out that `keeps` is false for. Returns how many are not.
template <class Keeps>
inline unsigned filter(SmallLists& lists, Keeps keeps) {
  unsigned kept = 0;
  for (unsigned i = 0; i < lists.overlaps; ++i) {
    PlacePair& pair = lists.pairs[i];
    const bool keep = keeps(pair, lists.active[pair.earlier()], lists.active[pair.later()]);
    pair.leaveOut(!keep);
    kept += keep;
  }
  return kept;
}

// Brings all AABBs up to date and finds the pairs, the AABBTest functions apart. `still`: no geom
// became dirty, came or went since the last frame. Reads the thread's floating-point mode before it
// computes: reading it waits for all computations before. `counts` are written member by member and
// not copied: a copy waits until words just written have reached the cache.
inline void find(const Scene& scene, const PairRules& rules, bool still, SmallLists& lists,
                 FrameCounts& counts) {
  bool by_filters = false;
  still = still && listActive<true>(scene.slots, lists, counts, by_filters);
  lists.same = still && lists.takes_all && !by_filters && rules.isODEs();
  unsigned pairs = lists.overlaps;
  if (!lists.same) {
    bool is_exact = !differs(currentMode(), exactMode());
    if (!still) {
      const Cleaned cleaned = cleanOneByOne(scene.first);
      counts.moved = cleaned.moved;
      is_exact = is_exact && !cleaned.by_others;
      scene.noteClean();
    }
    std::optional<ScopedMode> mode;
    if (!is_exact) mode.emplace(exactMode());
    if (!still) {
      lists.unbounded = 0;
      lists.user_classes = false;
      listActive<false>(scene.slots, lists, counts, by_filters);
      lists.overlaps = lists.actives > most_without_vectors
                           ? findByVectors(lists, lists.actives)
                           : findOneByOne(lists.active.data(), lists.actives, lists.pairs.data());
    }
    lists.takes_all = !by_filters && rules.isODEs() && !lists.user_classes;
    const auto mayPair = [&](PlacePair, dxGeom* a, dxGeom* b) { return rules.mayPair(a, b); };
    pairs = lists.takes_all && !still ? lists.overlaps : filter(lists, mayPair);
  }
  counts.geoms = static_cast<unsigned>(scene.count);
  counts.unbounded = lists.unbounded;
  counts.disabled = counts.geoms - lists.actives - counts.invalid;
  counts.candidates = counts.pairs = pairs;
}

// Not inline: the loop needs all registers.
__attribute__((noinline)) void reportPairs(const Scene& scene, const SmallLists& lists,
                                           PairReceiver receiver) {
  const Reports reports = scene.reports;  // in registers
  const Reports::Open open(reports, receiver.opens);
  dxGeom* const* const active = lists.active.data();
  const PlacePair *const pairs = lists.pairs.data(), *const end = pairs + lists.overlaps;
  const std::size_t slots = scene.slots.size();
  const auto isThere = [&](const dxGeom* geom) {
    const auto end = scene.slots.begin() + slots;
    return std::find(scene.slots.begin(), end, geom) != end;
  };
  for (const PlacePair* pair = pairs; pair < end; ++pair) {
    if (pair->isLeftOut()) continue;
    dxGeom *const a = active[pair->earlier()], *const b = active[pair->later()];
    if (__builtin_expect(!reports.changed(), 1) || (isThere(a) && isThere(b)))
      receiver.callback(receiver.data, a, b);
    else if (receiver.gap)
      receiver.gap(receiver.data);
  }
  if (receiver.end) receiver.end(receiver.data);
}

}  // namespace

bool SmallLists::grow(std::size_t geoms) try {
  const std::size_t cells = geoms > most_without_vectors ? groupsFor(geoms) : 0;
  pairs.resizeDiscarding(geoms * (geoms - 1) / 2);
  boxes.resizeDiscarding(cells);
  active.resizeDiscarding(geoms);  // at last: so many are ready
  std::fill(active.begin(), active.end(), nullptr);
  return true;
} catch (const std::bad_alloc&) {
  active.release();
  return false;
}

// The same promises as the other frames' without stages or clocks: for so few geoms those would
// take most of the time. While no geom is dirty, comes or goes, the boxes that overlap stay, and
// only what ODE does not announce is tested again. The lists have room.
FrameCounts Pipeline::collideSmall(const FrameCall& call, const PairReceiver& receiver,
                                   bool shows_pairs) {
  const Scene& scene = call.scene;
  SmallLists& lists = call.lists.small;
  if (stages_) stages_->cache.stop();
  shows_pairs = shows_pairs && !scene.nested && observers.isDue();
  const bool timed = statistics.beginSmallFrame();
  const Clock::time_point begin = timed ? Clock::now() : Clock::time_point();
  const std::uint64_t changes = changes_;
  const bool still =
      mechanisms::still_small_scenes && lists.changes == changes && !scene.needs_clean;
  FrameCounts counts;
  find(scene, settings.rules, still, lists, counts);
  lists.changes = changes;  // what changed meanwhile counts for the next one
  for (dxGeom* geom = counts.invalid ? scene.first : nullptr; geom; geom = geom->next)
    if (isEnabled(geom) && hasNaN(geom)) complaints.ofInvalid(geom);
  if (lists.user_classes)
    counts.pairs = filter(lists, [](PlacePair pair, dxGeom* a, dxGeom* b) {
      return !pair.isLeftOut() && passesAABBTests(a, b);
    });
  if (events_ && !scene.nested && !updateSmallEvents(call, counts.pairs))
    complaints.ofUnreportedEvents();

  const unsigned long long frame = statistics.frames();
  statistics.noteSmall(counts);
  const Clock::time_point reporting = timed ? Clock::now() : begin;
  if (shows_pairs) {
    for (unsigned i = 0; i < lists.overlaps; ++i)
      if (const PlacePair pair = lists.pairs[i]; !pair.isLeftOut())
        observers.see(lists.active[pair.earlier()], lists.active[pair.later()]);
    observers.endPairs();
  }
  reportPairs(scene, lists, receiver);
  if (statistics.frames() != frame)  // a collide within the callback wrote its own
    statistics.noteSmall(counts);
  if (timed)
    statistics.noteSmallTimes(milliseconds(begin, reporting),
                              milliseconds(reporting, Clock::now()));
  return counts;
}

// False without memory for it.
bool Pipeline::updateSmallEvents(const FrameCall& call, unsigned pair_count) {
  const SmallLists& lists = call.lists.small;
  if (lists.same && events_->updateSame()) return true;
  try {
    if (!made(small_pairs_)) throw std::bad_alloc();
    small_pairs_->clear(1);
    Buffer<Pair>& pairs = small_pairs_->parts[0];
    pairs.resizeDiscarding(pair_count);
    Pair* to = pairs.data();
    for (unsigned i = 0; i < lists.overlaps; ++i)
      if (const PlacePair pair = lists.pairs[i]; !pair.isLeftOut())
        *to++ = makePair(Slots::slotOf(lists.active[pair.earlier()]),
                         Slots::slotOf(lists.active[pair.later()]));
    small_pairs_->addParts(/*decided=*/true);
  } catch (const std::bad_alloc&) {
    events_->updateUnknown();
    return false;
  }
  return events_->update(*small_pairs_, call.scene.slots, settings.rules, 1);
}

}  // namespace ode_parallel_sap
