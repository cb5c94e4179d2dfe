// dSpaceCollide of the smallest scenes: all stages in one pass.
#include <algorithm>
#include <new>

#include "space/frame/space_scopes.h"
#include "space/geom/geom_tests.h"
#include "space/ode/ode_space.h"

namespace ode_parallel_sap {

namespace {

// Up to this number of geoms pairs are tested without vectors.
constexpr unsigned most_without_vectors = 14;
// From this number of geoms on it pays to look whether they are as before.
constexpr int least_remembered = 4;

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

}  // namespace

// Reading the clock takes longer than colliding a few geoms.
bool ParallelSAPSpace::timesSmallest() {
  constexpr unsigned interval = 16;  // frames
  return settings.print_stats || (timed_ && smallest_frames_++ % interval == 0);
}

bool ParallelSAPSpace::isSmallest() const {
  return geoms_.size() <= smallest_scene && settings.method != dParallelSAPMethodSweep &&
         settings.method != dParallelSAPMethodAxisLists &&
         settings.backend != dParallelSAPBackendCUDA;
}

// The same promises without boxes, lists or clocks: for so few geoms those would take most of the
// time.
void ParallelSAPSpace::collideSmallest(void* data, dNearCallback* callback) {
  const bool timed = timesSmallest();
  const Clock::time_point begin = timed ? Clock::now() : Clock::time_point();
  pair_keeper_.stop();
  noteSilent();
  SmallScene scene;
  if (isStill()) {
    still_scene_->recall(scene);
  } else {
    scene.moved = cleanOneByOne();
    needs_clean_ = false;
    findSmallest(scene);
    rememberStill(scene);
  }
  testSmallest(scene);

  const unsigned long long frame = stats_.frames;
  noteSmallest(scene);
  const Clock::time_point found = timed ? Clock::now() : begin;
  for (std::size_t i = 0; i < scene.pairs; ++i) {
    const SmallScene::Couple couple = scene.couples[i];
    callback(data, scene.active[couple.earlier()], scene.active[couple.later()]);
  }
  if (stats_.frames != frame) noteSmallest(scene);  // a collide within the callback wrote its own
  if (timed) {
    const Clock::time_point end = Clock::now();
    stats_.extract_ms = milliseconds(begin, found);
    stats_.report_ms = milliseconds(found, end);
    stats_.total_ms = milliseconds(begin, end);
  }
}

void ParallelSAPSpace::findSmallest(SmallScene& scene) {
  {
    const ScopedMode mode(exactMode());
    for (dxGeom* geom = first; geom; geom = geom->next) {
      if (!isEnabled(geom)) continue;
      if (!isPlain(geom)) {
        if (hasNaN(geom)) {
          ++scene.invalid;
          continue;
        }
        scene.unbounded += isUnbounded(geom);
      }
      scene.user_classes = scene.user_classes || isUserClass(geom);
      scene.active[scene.actives++] = geom;
    }
    const bool all_wanted = !settings.rules.skip() && !settings.rules.cull_planes;
    const auto take = [&](unsigned i, unsigned j) {
      dxGeom *const a = scene.active[i], *const b = scene.active[j];
      if (filtersMatch(a, b) &&
          (all_wanted || (!isCulled(a, b) && !isLeftOut(a, b, settings.rules))))
        scene.couples[scene.candidates++] = {static_cast<std::uint16_t>(i << 8 | j)};
    };
    if (scene.actives > most_without_vectors)
      forOverlapping(scene.active, scene.actives, take);
    else
      for (unsigned i = 0; i < scene.actives; ++i)
        for (unsigned j = i + 1; j < scene.actives; ++j)
          if (boxesOverlap(scene.active[i], scene.active[j])) take(i, j);
  }
  for (dxGeom* geom = first; scene.invalid && geom; geom = geom->next)
    if (isEnabled(geom) && hasNaN(geom)) reportInvalid(geom);
}

// Whether all is as in the frame that was remembered. What dirty() is called for ends that.
bool ParallelSAPSpace::isStill() const {
  return is_still_ && still_scene_->holds(first, settings.rules);
}

// The second of two frames without a move is remembered, where that says it all: not what rules
// leave out by the state of bodies.
void ParallelSAPSpace::rememberStill(const SmallScene& scene) {
  is_still_ = false;
  still_frames_ = scene.moved == 0 ? still_frames_ + 1 : 0;
  if (still_frames_ < 2 || count < least_remembered || settings.rules.skip()) return;
  try {
    if (!still_scene_) still_scene_ = std::make_unique<StillScene>();
    still_scene_->remember(first, settings.rules, scene);
    is_still_ = true;
  } catch (const std::bad_alloc&) {
  }
}

// Leaves the couples that pass the AABBTest functions as the pairs.
void ParallelSAPSpace::testSmallest(SmallScene& scene) {
  if (!scene.user_classes) {
    scene.pairs = scene.candidates;
    return;
  }
  for (std::size_t i = 0; i < scene.candidates; ++i) {
    const SmallScene::Couple couple = scene.couples[i];
    if (passesAABBTests(scene.active[couple.earlier()], scene.active[couple.later()]))
      scene.couples[scene.pairs++] = couple;
  }
}

void ParallelSAPSpace::noteSmallest(const SmallScene& scene) {
  if (!stats_of_smallest_) {
    const unsigned long long frames = stats_.frames;
    stats_ = {};
    stats_.frames = frames;
    stats_.backend = dParallelSAPBackendCPU;
    stats_.method = dParallelSAPMethodBruteForce;
    stats_.threads = 1;
    stats_of_smallest_ = true;
  }
  stats_.geoms = count;
  stats_.moved = scene.moved;
  stats_.disabled = count - scene.actives - scene.invalid;
  stats_.invalid = scene.invalid;
  stats_.unbounded = scene.unbounded;
  stats_.candidates = scene.candidates;
  stats_.pairs = scene.pairs;
}

}  // namespace ode_parallel_sap
