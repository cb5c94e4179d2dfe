#include "parallel_sap_space.h"

#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

#include "geom_tests.h"
#include "plane_test.h"

namespace ode_parallel_sap {

namespace {

// Up to this number of slots a scene is collided pair by pair on the spot.
constexpr std::size_t smallest_scene = 40;
// Up to this number of slots testing all pairs is faster than ordering boxes.
constexpr std::size_t brute_force_scene = 700;
// Threads are worth their start from this many slots on, and each of them from this many.
constexpr std::size_t least_shared_scene = 4096;
constexpr std::size_t least_slots_a_thread = 1024;
// Where all pairs are tested there is more to do.
constexpr std::size_t least_shared_brute_force = 1024;
constexpr std::size_t most_slots = std::size_t{1} << 28;

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

std::size_t slotIn(const dxGeom* geom) {
  return reinterpret_cast<std::size_t>(geom->tome_ex) - 1;
}
void setSlot(dxGeom* geom, std::size_t slot) {
  geom->tome_ex = reinterpret_cast<dxGeom**>(slot + 1);
}
void clearSlot(dxGeom* geom) {
  geom->tome_ex = nullptr;
}

// dGeomTriMeshSetData makes a mesh dirty by itself, and dGeomMoved, which tells a space of clean
// geoms only, says nothing of a dirty one or of the spaces around it from then on.
bool mayBeSilent(const dxGeom* geom) {
  return geom->type == dTriMeshClass || IS_SPACE(geom);
}

}  // namespace

// Locks the space against changes to its contents, until the scope is left in whatever way.
class ParallelSAPSpace::Lock {
 public:
  explicit Lock(ParallelSAPSpace& space) : space_(space) { ++space_.lock_count; }
  ~Lock() { --space_.lock_count; }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  ParallelSAPSpace& space_;
};

// Hands out the time since it was last asked.
class ParallelSAPSpace::StageClock {
 public:
  StageClock() : begin_(Clock::now()), lap_(begin_) {}
  double lap() {
    const Clock::time_point before = lap_;
    lap_ = Clock::now();
    return milliseconds(before, lap_);
  }
  double total() const { return milliseconds(begin_, lap_); }

 private:
  const Clock::time_point begin_;
  Clock::time_point lap_;
};

// The list of pairs while the callback runs, out of reach of a collide within it, which finds the
// members free. Goes back when the scope is left in whatever way.
class ParallelSAPSpace::Frame {
 public:
  explicit Frame(ParallelSAPSpace& space)
      : pairs(std::move(space.pairs_)), space_(space), number_(space.stats_.frames) {}
  ~Frame() {
    space_.pairs_ = std::move(pairs);
    if (space_.stats_.frames != number_) space_.pair_keeper_.stop();
  }
  Frame(const Frame&) = delete;
  Frame& operator=(const Frame&) = delete;

  PairList pairs;

 private:
  ParallelSAPSpace& space_;
  const unsigned long long number_;
};

ParallelSAPSpace::ParallelSAPSpace(dSpaceID parent, int space_class)
    : dxSpace(parent), settings(settingsFromEnvironment()) {
  type = space_class;
  timed_ = settings.print_stats;
}

ParallelSAPSpace::~ParallelSAPSpace() {
  CHECK_NOT_LOCKED(this);
  if (settings.print_stats && totals_.frames) {
    const double frames = static_cast<double>(totals_.frames);
    dMessage(0,
             "parallel SAP space %p: %llu frames, a frame: %.0f geoms, %.0f pairs, %.3f ms (update "
             "%.3f, synchronise %.3f, extract %.3f, filter %.3f, narrow %.3f, report %.3f)",
             static_cast<void*>(this), totals_.frames, totals_.geoms / frames,
             totals_.pairs / frames, totals_.total_ms / frames, totals_.update_ms / frames,
             totals_.synchronise_ms / frames, totals_.extract_ms / frames,
             totals_.filter_ms / frames, totals_.narrow_ms / frames, totals_.report_ms / frames);
  }
  // The base class's destructor would not reach remove() any more.
  while (first) {
    if (cleanup)
      dGeomDestroy(first);
    else
      remove(first);
  }
}

void ParallelSAPSpace::add(dxGeom* geom) {
  CHECK_NOT_LOCKED(this);
  dAASSERT(geom);
  dUASSERT(geom->parent_space == 0 && geom->next == 0, "geom is already in a space");
  dUASSERT(geoms_.size() < most_slots, "too many geoms in a parallel SAP space");

  constexpr std::size_t least_gaps = 64;
  if (geoms_.size() - count >= std::max<std::size_t>(least_gaps, count)) closeSlots();
  // All that may throw comes before the geom is known here.
  const Slot slot = static_cast<Slot>(geoms_.size());
  pair_keeper_.change(slot);
  silent_.growTo(slot + std::size_t{1});
  geoms_.push_back(geom);
  setSlot(geom, slot);
  silent_.insert(slot);  // it may not know its type yet
  plane_pairs_.forget();
  geom->next = nullptr;
  geom->tome = tail_;
  *tail_ = geom;
  tail_ = &geom->next;
  geom->parent_space = this;
  ++count;
  current_geom = nullptr;

  // A geom that comes clean from elsewhere is new here all the same.
  geom->gflags |= GEOM_DIRTY | GEOM_AABB_BAD;
  dirty(geom);
  dGeomMoved(this);
}

void ParallelSAPSpace::remove(dxGeom* geom) {
  CHECK_NOT_LOCKED(this);
  dAASSERT(geom);
  dUASSERT(geom->parent_space == this, "object is not in this space");

  queries_.changed(slotIn(geom));
  plane_pairs_.forget();
  pair_keeper_.change(static_cast<Slot>(slotIn(geom)));
  silent_.erase(static_cast<Slot>(slotIn(geom)));
  geoms_[slotIn(geom)] = nullptr;
  while (geoms_.size() && !geoms_[geoms_.size() - 1]) geoms_.resize(geoms_.size() - 1);
  clearSlot(geom);
  if (!reported_invalid_.empty()) reported_invalid_.erase(geom);
  if (!geom->next) tail_ = geom->tome;
  dxSpace::remove(geom);
}

void ParallelSAPSpace::dirty(dxGeom* geom) {
  needs_clean_ = true;
  queries_.changed(slotIn(geom));
  pair_keeper_.change(static_cast<Slot>(slotIn(geom)));
}

// Closes the gaps that removed geoms left, once they are a quarter of all slots.
void ParallelSAPSpace::closeSlots() {
  const std::size_t gaps = geoms_.size() - count;
  if (gaps == 0 || gaps < geoms_.size() / 4) return;
  pair_keeper_.stop();
  silent_.clear();
  std::size_t slot = 0;
  for (dxGeom* const geom : geoms_) {
    if (!geom) continue;
    geoms_[slot] = geom;
    setSlot(geom, slot);
    if (mayBeSilent(geom)) silent_.insert(static_cast<Slot>(slot));
    ++slot;
  }
  geoms_.resize(slot);
  queries_.reset();
  plane_pairs_.forget();
}

void ParallelSAPSpace::noteSilent() {
  silent_.forEach([this](Slot slot) {
    dxGeom* const geom = geoms_[slot];
    if (!mayBeSilent(geom))
      silent_.erase(slot);
    else if (geom->gflags & GEOM_DIRTY)
      dirty(geom);
  });
}

void ParallelSAPSpace::cleanGeoms() {
  if (!needs_clean_) return;
  const Lock lock(*this);
  noteSilent();
  try {
    geom_update_.clean(geoms_.data(), geoms_.size(), threadsForFrame(), pair_keeper_.changed());
  } catch (const std::bad_alloc&) {
    cleanOneByOne();
  }
  needs_clean_ = false;
}

std::size_t ParallelSAPSpace::cleanOneByOne() {
  std::size_t moved = 0;
  for (dxGeom* geom = first; geom; geom = geom->next) {
    if (!(geom->gflags & GEOM_DIRTY)) continue;
    cleanGeom(geom);
    ++moved;
  }
  return moved;
}

// The most threads that are worth their start for this number of geoms.
int ParallelSAPSpace::threadsForScene() const {
  const std::size_t slots = geoms_.size();
  if ((settings.method == dParallelSAPMethodBruteForce ||
       settings.method == dParallelSAPMethodAxisLists) &&
      slots >= least_shared_brute_force)
    return threadsFor(settings);
  if (slots < least_shared_scene) return 1;
  return static_cast<int>(
      std::min<std::size_t>(threadsFor(settings), slots / least_slots_a_thread));
}

// A number that the user set is taken as it is.
int ParallelSAPSpace::threadsForFrame() const {
  const int threads = threadsForScene();
  return settings.threads == 0 ? team_choice_.threads(threads) : threads;
}

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

void ParallelSAPSpace::beginFrame() {
  // Within a callback of this space the slots stay what they are.
  if (lock_count == 1) closeSlots();
  queries_.noteFrame();
  ++stats_.frames;
  stats_.geoms = count;
  stats_.contacts = 0;
  stats_.narrow_ms = 0;
}

// Called before each frame, for the last one. The storage of the devices stays: it took too long to
// get.
void ParallelSAPSpace::releaseSpareMemory() {
  if (lock_count > 1 || !memory_watch_.isTooMuchAfter(count, stats_.pairs)) return;
  closeSlots();
  geoms_.shrink();
  queries_.release();
  hits_.release();
  pair_keeper_.release();
  geom_update_ = GeomUpdate();
  boxes_ = BoxSet();
  cpu_finders_.reset();
  pair_filter_ = PairFilter();
  plane_pairs_ = PlanePairs();
  pairs_ = PairList();
  kept_ = PairList();
  kept_apart_ = false;
  contact_pairs_.release();
  narrow_phase_ = NarrowPhase();
}

void ParallelSAPSpace::collide(void* data, dNearCallback* callback) {
  dAASSERT(callback);
  const Lock lock(*this);
  releaseSpareMemory();
  beginFrame();
  if (isSmallest()) {
    collideSmallest(data, callback);
    if (timed_) countTotals();
    return;
  }

  // A collide within the callback finds the members free: what it needs is taken out of them.
  StageClock clock;
  Frame frame(*this);
  if (!findPairs(frame.pairs, threadsForFrame(), clock)) {
    collideWithoutMemory(data, callback);
    clock.lap();
    stats_.total_ms = clock.total();
    return;
  }
  dParallelSAPStats own = stats_;
  report(frame.pairs, data, callback);
  own.report_ms = clock.lap();
  own.total_ms = clock.total();
  own.frames = stats_.frames;
  stats_ = own;
  countTotals();
}

// All stages but the report: the pairs of the frame, in their order. `pairs` comes with those of
// the last frame. False where there is no memory for them.
bool ParallelSAPSpace::findPairs(PairList& pairs, int threads, StageClock& clock) try {
  stats_of_smallest_ = false;
  stats_.report_ms = stats_.total_ms = 0;  // should the callback throw
  stats_.backend = dParallelSAPBackendCPU;
  stats_.devices = 0;
  frame_threads_ = threads;
  if (kept_apart_) std::swap(pairs, kept_);
  kept_apart_ = false;
  noteSilent();
  if (!findChanges(pairs, clock)) findAll(pairs, clock);
  const bool planes_apart = settings.rules.cull_planes && plane_pairs_.any();
  if (planes_apart || PairFilter::needsVerifying(*facts_, settings.rules)) {
    kept_apart_ = true;
    std::swap(pairs, kept_);
    if (PairFilter::needsVerifying(*facts_, settings.rules))
      PairFilter::verify(geoms_.data(), *facts_, kept_, pairs);
    else
      pairs.copyFrom(kept_);
    if (planes_apart)
      stats_.candidates += plane_pairs_.addTo(pairs, geoms_.data(), boxes_, settings.rules,
                                              facts_->user_classes, frame_threads_);
  }
  stats_.filter_ms += clock.lap();
  stats_.pairs = pairs.size();
  return true;
} catch (const std::bad_alloc&) {
  pair_keeper_.stop();
  return false;
} catch (...) {
  pair_keeper_.stop();  // from the AABB function of a user class, say
  throw;
}

// Where method and back end were left to the space, or to the sweep on the CPU. Not within a
// callback, which has the pairs.
bool ParallelSAPSpace::mayKeep() const {
  return lock_count == 1 && settings.backend != dParallelSAPBackendCUDA &&
         (settings.method == dParallelSAPMethodAuto || settings.method == dParallelSAPMethodSweep);
}

bool ParallelSAPSpace::findChanges(PairList& pairs, StageClock& clock) {
  if (!mayKeep() || !pair_keeper_.update(geoms_.data(), geoms_.size(), settings.rules,
                                         frame_threads_, geom_update_, boxes_))
    return false;
  needs_clean_ = false;
  stats_.update_ms = clock.lap();
  facts_ = &geom_update_.facts();
  noteFacts();
  stats_.synchronise_ms = clock.lap();
  stats_.threads = pair_keeper_.find(geoms_.data(), geom_update_, settings.rules, boxes_,
                                     frame_threads_, finders(), pair_filter_, pairs);
  stats_.candidates = pair_keeper_.candidates();
  stats_.kept = pair_keeper_.kept();
  stats_.extract_ms = clock.lap();
  stats_.filter_ms = 0;
  return true;
}

void ParallelSAPSpace::findAll(PairList& pairs, StageClock& clock) {
  pair_keeper_.stop();
  update();
  pair_keeper_.forgetChanges();
  stats_.update_ms = clock.lap();
  synchronise();
  stats_.moved += pair_keeper_.movedInVain();
  stats_.synchronise_ms = clock.lap();
  extract(pairs);
  stats_.extract_ms = clock.lap();
  pair_filter_.run(geoms_.data(), *facts_, settings.rules, boxes_, frame_threads_, pairs);
  stats_.filter_ms = clock.lap();
  stats_.kept = 0;
  if (settings.threads == 0 && threadsForScene() > 1)
    team_choice_.learn(stats_.threads, geoms_.size(), clock.total());
  if (!mayKeep()) return;
  pair_keeper_.start(stats_.backend != dParallelSAPBackendCPU   ? PairKeeper::Source::device
                     : stats_.method == dParallelSAPMethodSweep ? PairKeeper::Source::sweep
                                                                : PairKeeper::Source::all_pairs);
}

// A contact callback that collides this space again finds the members free, as one of collide does.
void ParallelSAPSpace::collideContacts(const ContactRequest& request) {
  const Lock lock(*this);
  releaseSpareMemory();
  StageClock clock;
  ContactPairs pairs(request, std::move(contact_pairs_));
  NarrowPhase narrow_phase = std::move(narrow_phase_);
  const bool smallest = isSmallest();
  collectPairs(pairs, clock);
  dParallelSAPStats own = stats_;
  if (smallest) clock.lap();
  const bool found = collideCollected(pairs.list(), request, narrow_phase, own);
  own.narrow_ms = clock.lap();
  if (found)
    narrow_phase.report(pairs.list(), request);
  else
    NarrowPhase::collideOneByOne(pairs.list(), request);
  own.report_ms = clock.lap();
  own.total_ms = clock.total();
  own.frames = stats_.frames;
  stats_ = own;
  stats_of_smallest_ = false;  // these have times
  if (!smallest || timed_) countTotals();
  contact_pairs_ = pairs.release();
  narrow_phase_ = std::move(narrow_phase);
}

// All stages up to the list of pairs.
void ParallelSAPSpace::collectPairs(ContactPairs& pairs, StageClock& clock) {
  beginFrame();
  if (isSmallest()) {
    collideSmallest(&pairs, &dParallelSAPAddPair);
    return;
  }
  Frame frame(*this);
  // Where there is a team, one that is as large as that of the narrow phase: some OpenMP runtimes
  // end the threads that a smaller team does without, and start new ones for the next large one.
  const int threads = threadsForFrame() > 1 ? threadsFor(settings) : 1;
  if (findPairs(frame.pairs, threads, clock))
    pairs.add(frame.pairs, geoms_.data(), facts_->spaces, frame_threads_);
  else
    collideWithoutMemory(&pairs, &dParallelSAPAddPair);
}

// The narrow phase itself. False where there is no memory for the contacts.
bool ParallelSAPSpace::collideCollected(const Buffer<GeomPair>& pairs,
                                        const ContactRequest& request, NarrowPhase& narrow_phase,
                                        dParallelSAPStats& stats) try {
  const Clock::time_point begin = Clock::now();
  const int threads = threadsFor(settings);
  const int team = settings.threads == 0 ? narrow_team_choice_.threads(threads) : threads;
  const int used = narrow_phase.run(pairs, request, team, getManualCleanup() != 0);
  if (settings.threads == 0 && threads > 1)
    narrow_team_choice_.learn(used, pairs.size(), milliseconds(begin, Clock::now()));
  stats.threads = std::max(stats.threads, used);
  stats.contacts = narrow_phase.contacts();
  return true;
} catch (const std::bad_alloc&) {
  narrow_phase = NarrowPhase();  // going on one by one needs memory, too
  return false;
}

// The same promises without boxes, lists or clocks: for so few geoms those would take most of the
// time.
void ParallelSAPSpace::collideSmallest(void* data, dNearCallback* callback) {
  const bool timed = timesSmallest();
  const Clock::time_point begin = timed ? Clock::now() : Clock::time_point();
  pair_keeper_.stop();
  dxGeom* active[smallest_scene];
  unsigned actives = 0, invalid = 0, unbounded = 0;
  const std::size_t moved = cleanOneByOne();
  needs_clean_ = false;

  struct Couple {
    std::uint8_t earlier, later;
  };
  Couple couples[smallest_scene * (smallest_scene - 1) / 2];
  std::size_t candidates = 0;
  {
    const ScopedMode mode(exactMode());
    for (dxGeom* geom = first; geom; geom = geom->next) {
      if (!isEnabled(geom)) continue;
      if (!isPlain(geom)) {
        if (hasNaN(geom)) {
          ++invalid;
          continue;
        }
        unbounded += isUnbounded(geom);
      }
      active[actives++] = geom;
    }
    for (unsigned i = 0; i < actives; ++i)
      for (unsigned j = i + 1; j < actives; ++j)
        if (boxesOverlap(active[i], active[j]) && filtersMatch(active[i], active[j]) &&
            !isCulled(active[i], active[j]) && !isLeftOut(active[i], active[j], settings.rules))
          couples[candidates++] = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j)};
  }
  for (dxGeom* geom = first; invalid && geom; geom = geom->next)
    if (isEnabled(geom) && hasNaN(geom)) reportInvalid(geom);
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < candidates; ++i)
    if (passesAABBTests(active[couples[i].earlier], active[couples[i].later]))
      couples[pairs++] = couples[i];

  const unsigned long long frame = stats_.frames;
  const auto writeStats = [&] {
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
    stats_.moved = moved;
    stats_.disabled = count - actives - invalid;
    stats_.invalid = invalid;
    stats_.unbounded = unbounded;
    stats_.candidates = candidates;
    stats_.pairs = pairs;
  };
  writeStats();
  const Clock::time_point found = timed ? Clock::now() : begin;
  for (std::size_t i = 0; i < pairs; ++i)
    callback(data, active[couples[i].earlier], active[couples[i].later]);
  if (stats_.frames != frame) writeStats();  // a collide within the callback wrote its own
  if (timed) {
    const Clock::time_point end = Clock::now();
    stats_.extract_ms = milliseconds(begin, found);
    stats_.report_ms = milliseconds(found, end);
    stats_.total_ms = milliseconds(begin, end);
  }
}

void ParallelSAPSpace::update() {
  stats_.threads =
      geom_update_.pack(geoms_.data(), geoms_.size(), settings.rules, frame_threads_, boxes_);
  needs_clean_ = false;
}

void ParallelSAPSpace::synchronise() {
  facts_ = &geom_update_.synchronise(geoms_.data(), boxes_);
  noteFacts();
}

void ParallelSAPSpace::noteFacts() {
  for (const Slot slot : facts_->newly_invalid) reportInvalid(geoms_[slot]);
  stats_.moved = facts_->moved;
  stats_.disabled = facts_->disabled;
  stats_.invalid = facts_->invalid;
  stats_.unbounded = facts_->unbounded;
  if (settings.rules.cull_planes) plane_pairs_.take(geoms_.data(), boxes_);
}

CPUFinders& ParallelSAPSpace::finders() {
  if (!cpu_finders_) cpu_finders_ = std::make_unique<CPUFinders>(settings.axis_lists_bytes);
  return *cpu_finders_;
}

void ParallelSAPSpace::extract(PairList& pairs) {
  const bool on_device = settings.backend == dParallelSAPBackendCUDA;
  int method = settings.method;
  if (method == dParallelSAPMethodAuto)
    method = geoms_.size() <= brute_force_scene && !on_device ? dParallelSAPMethodBruteForce
                                                              : dParallelSAPMethodSweep;
  try {
    extractBy(method, pairs);
  } catch (const ListsTooLong& lists) {
    reportTooLong(lists);
    method = dParallelSAPMethodSweep;
    extractBy(method, pairs);
  }
  stats_.method = method;
  stats_.candidates = pairs.size();
}

void ParallelSAPSpace::extractBy(int method, PairList& pairs) {
  const bool may_be_on_device = settings.backend != dParallelSAPBackendCPU;
  if (may_be_on_device && method == dParallelSAPMethodSweep && !boxes_.wide) {
    extractWhereFastest(method, pairs);
    return;
  }
  if (settings.backend == dParallelSAPBackendCUDA && method == dParallelSAPMethodAxisLists) {
    const int devices = std::max(1, settings.devices);
    // One thread drives each device, in small scenes too.
    const int threads = std::max(frame_threads_, std::min(devices, threadsFor(settings)));
    countDevices(
        device_.findByAxisLists(boxes_, threads, devices, settings.axis_lists_bytes, pairs));
  }
  if (stats_.devices == 0) extractOnProcessor(method, pairs);
}

void ParallelSAPSpace::extractWhereFastest(int method, PairList& pairs) {
  const Clock::time_point begin = Clock::now();
  const DeviceBackend::Wish wish = {settings.backend == dParallelSAPBackendAuto, settings.devices};
  const int devices = device_.choose(boxes_, wish);
  if (devices > 0) countDevices(device_.find(boxes_, frame_threads_, devices, pairs));
  if (stats_.devices == 0) extractOnProcessor(method, pairs);
  device_.learn(wish, stats_.devices, boxes_.size, pairs.size(), milliseconds(begin, Clock::now()));
}

void ParallelSAPSpace::countDevices(int devices) {
  stats_.devices = devices;
  if (devices > 0) stats_.backend = dParallelSAPBackendCUDA;
}

void ParallelSAPSpace::extractOnProcessor(int method, PairList& pairs) {
  stats_.threads = std::max(stats_.threads,
                            finders().of(method, boxes_.wide).find(boxes_, frame_threads_, pairs));
}

// By bounds, bits and bodies.
bool ParallelSAPSpace::pairsExactly(dxGeom* a, dxGeom* b) const {
  const ScopedMode mode(exactMode());
  return boxesOverlap(a, b) && filtersMatch(a, b) && !isCulled(a, b);
}

// Needs exactMode().
bool ParallelSAPSpace::isCulled(dxGeom* a, dxGeom* b) const {
  return settings.rules.cull_planes && areClearByPlane(a, b);
}

void ParallelSAPSpace::report(const PairList& pairs, void* data, dNearCallback* callback) {
  for (const Buffer<Pair>& part : pairs.parts)
    for (const Pair pair : part) callback(data, geoms_[earlierOf(pair)], geoms_[laterOf(pair)]);
}

// The last resort: all pairs one by one, which takes time but no memory.
void ParallelSAPSpace::collideWithoutMemory(void* data, dNearCallback* callback) {
  if (!out_of_memory_reported_)
    dMessage(0, "parallel SAP space: out of memory, pairs are tested one by one");
  out_of_memory_reported_ = true;
  stats_.method = dParallelSAPMethodBruteForce;
  stats_.threads = 1;
  stats_.pairs = 0;
  cleanOneByOne();
  for (dxGeom* a = first; a; a = a->next) {
    if (!isEnabled(a) || hasNaN(a)) continue;
    for (dxGeom* b = a->next; b; b = b->next) {
      if (!isEnabled(b) || hasNaN(b)) continue;
      if (!pairsExactly(a, b) || isLeftOut(a, b, settings.rules) || !passesAABBTests(a, b))
        continue;
      ++stats_.pairs;
      callback(data, a, b);
    }
  }
}

void ParallelSAPSpace::collide2(void* data, dxGeom* geom, dNearCallback* callback) {
  dAASSERT(geom && callback);
  const Lock lock(*this);
  if (needs_clean_) noteSilent();
  if (needs_clean_ && queries_.clean(geoms_)) needs_clean_ = false;
  cleanGeoms();
  geom->recomputeAABB();
  if (hasNaN(geom) || (IS_SPACE(geom) && static_cast<dxSpace*>(geom)->count == 0)) return;
  // As in collide(), a query within the callback finds the member free.
  Buffer<dxGeom*> hits = std::move(hits_);
  try {
    queries_.find(geoms_, geom, settings.rules.cull_planes, threadsForFrame(), hits);
  } catch (const std::bad_alloc&) {
    queries_.release();
    collide2WithoutMemory(data, geom, callback);
    return;
  }
  std::size_t count = 0;
  for (dxGeom* const own : hits)
    if (passesAABBTests(own, geom)) hits[count++] = own;
  hits.resize(count);
  for (dxGeom* const own : hits) callback(data, own, geom);
  hits_ = std::move(hits);
}

void ParallelSAPSpace::collide2WithoutMemory(void* data, dxGeom* geom, dNearCallback* callback) {
  for (dxGeom* own = first; own; own = own->next) {
    if (!isEnabled(own) || hasNaN(own) || !pairsExactly(own, geom)) continue;
    if (passesAABBTests(own, geom)) callback(data, own, geom);
  }
}

void ParallelSAPSpace::reportInvalid(const dxGeom* geom) {
  if (reported_invalid_.insert(geom).second)
    dMessage(0, "parallel SAP space: geom %p has a NaN in its AABB and is left out of all pairs",
             static_cast<const void*>(geom));
}

void ParallelSAPSpace::reportTooLong(const ListsTooLong& lists) {
  if (!lists_too_long_reported_)
    dMessage(0,
             "parallel SAP space: the method AxisLists would need %.1f MB for the pairs of each "
             "axis and may take %.1f MB; the method Sweep is used where it does not fit",
             static_cast<double>(lists.needed) / 1e6, static_cast<double>(lists.allowed) / 1e6);
  lists_too_long_reported_ = true;
}

void ParallelSAPSpace::countTotals() {
  totals_.frames += 1;
  totals_.geoms += stats_.geoms;
  totals_.pairs += stats_.pairs;
  totals_.contacts += stats_.contacts;
  totals_.update_ms += stats_.update_ms;
  totals_.synchronise_ms += stats_.synchronise_ms;
  totals_.extract_ms += stats_.extract_ms;
  totals_.filter_ms += stats_.filter_ms;
  totals_.narrow_ms += stats_.narrow_ms;
  totals_.report_ms += stats_.report_ms;
  totals_.total_ms += stats_.total_ms;
}

std::size_t ParallelSAPSpace::memoryBytes() const {
  return sizeof *this + geoms_.bytes() + boxes_.bytes() +
         (cpu_finders_ ? cpu_finders_->bytes() : 0) + device_.bytes() + pairs_.bytes() +
         contact_pairs_.bytes() + narrow_phase_.bytes() + queries_.bytes() + hits_.bytes() +
         plane_pairs_.bytes() + silent_.bytes() + kept_.bytes() + geom_update_.bytes() +
         pair_keeper_.bytes();
}

const dParallelSAPStats& ParallelSAPSpace::stats() {
  timed_ = true;
  if (stats_.frames) stats_.memory_bytes = memoryBytes();
  return stats_;
}

ParallelSAPSpace* parallelSAPSpace(dSpaceID space) {
  return dynamic_cast<ParallelSAPSpace*>(space);
}

}  // namespace ode_parallel_sap
