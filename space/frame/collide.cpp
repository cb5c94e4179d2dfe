// dSpaceCollide and its kin: the stages of a frame, in their order.
#include <algorithm>
#include <new>

#include "space/data/grains.h"
#include "space/frame/space_scopes.h"
#include "space/geom/geom_tests.h"
#include "space/ode/ode_space.h"

namespace ode_parallel_sap {

// The most threads that are worth their start for this number of geoms.
int ParallelSAPSpace::threadsForScene() const {
  const bool tests_all = settings.method == dParallelSAPMethodBruteForce ||
                         settings.method == dParallelSAPMethodAxisLists;
  return teamFor(geoms_.size(), tests_all ? grains::scene_of_all_tests : grains::scene,
                 threadsFor(settings));
}

// A number that the user set is taken as it is.
int ParallelSAPSpace::threadsForFrame() const {
  const int threads = threadsForScene();
  return settings.threads == 0 ? team_choice_.threads(threads) : threads;
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

void ParallelSAPSpace::collide(void* data, dNearCallback* callback) {
  dAASSERT(callback);
  const Lock lock(*this);
  releaseSpareMemory();
  beginFrame();
  if (isSmallest()) {
    collideSmallest(data, callback);
    countTotals();
    return;
  }

  // A collide within the callback finds the members free: what it needs is taken out of them.
  StageClock clock;
  Frame frame(*this);
  if (!findPairs(frame.pairs, threadsForFrame(), clock)) {
    collideWithoutMemory(data, callback);
    clock.lap();
    stats_.total_ms = clock.total();
    countTotals();
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
  rules_ = lock_count == 1 ? pair_keeper_.rulesOfFrame(settings.rules) : settings.rules;
  noteSilent();
  if (!findChanges(pairs, clock)) findAll(pairs, clock);
  selectPairs(pairs);
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

// Makes the pairs that are to be reported out of those that may have to be, and keeps these apart
// where they are others.
void ParallelSAPSpace::selectPairs(PairList& pairs) {
  const bool planes_apart = rules_.cull_planes && plane_pairs_.any();
  const bool verifying = PairFilter::needsVerifying(*facts_, rules_);
  if (!planes_apart && !verifying) return;
  kept_apart_ = true;
  std::swap(pairs, kept_);  // `pairs` may be those of the last frame now
  if (verifying) {
    // The pairs but those of planes, which are put among them in the end.
    PairList& others = planes_apart ? others_ : pairs;
    others.copyFrom(kept_);
    PairFilter::verify(geoms_.data(), *facts_, frame_threads_, others);
  }
  if (planes_apart)
    stats_.candidates += plane_pairs_.addTo(verifying ? others_ : kept_, geoms_.data(), boxes_,
                                            rules_, facts_->user_classes, frame_threads_, pairs);
}

// Where method and back end were left to the space, or to the sweep on the CPU. Not within a
// callback, which has the pairs.
bool ParallelSAPSpace::mayKeep() const {
  return lock_count == 1 && settings.backend != dParallelSAPBackendCUDA &&
         (settings.method == dParallelSAPMethodAuto || settings.method == dParallelSAPMethodSweep);
}

bool ParallelSAPSpace::findChanges(PairList& pairs, StageClock& clock) {
  if (!mayKeep() || !pair_keeper_.update(geoms_.data(), geoms_.size(), rules_, frame_threads_,
                                         geom_update_, boxes_))
    return false;
  needs_clean_ = false;
  stats_.update_ms = clock.lap();
  facts_ = &geom_update_.facts();
  noteFacts();
  stats_.synchronise_ms = clock.lap();
  stats_.threads = pair_keeper_.find(geoms_.data(), geom_update_, rules_, boxes_, frame_threads_,
                                     finders(), pair_filter_, pairs);
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
  pair_filter_.run(geoms_.data(), *facts_, rules_, boxes_, frame_threads_, pairs);
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
  countTotals();
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

void ParallelSAPSpace::update() {
  stats_.threads = geom_update_.pack(geoms_.data(), geoms_.size(), rules_, frame_threads_, boxes_);
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
  if (rules_.cull_planes) plane_pairs_.take(geoms_.data(), boxes_);
}

CPUFinders& ParallelSAPSpace::finders() {
  if (!cpu_finders_) cpu_finders_ = std::make_unique<CPUFinders>(settings.axis_lists_bytes);
  return *cpu_finders_;
}

// Crowds of more than a few hundred geoms are told apart later: a device may take them.
int ParallelSAPSpace::fastestMethod() {
  constexpr std::size_t least_for_device = 700;  // slots
  const std::size_t slots = geoms_.size();
  return settings.backend == dParallelSAPBackendCUDA || slots > least_for_device ||
                 method_choice_.sweeps(slots, stats_.pairs)
             ? dParallelSAPMethodSweep
             : dParallelSAPMethodBruteForce;
}

void ParallelSAPSpace::extract(PairList& pairs) {
  int method = settings.method == dParallelSAPMethodAuto ? fastestMethod() : settings.method;
  stats_.method = method;
  try {
    extractBy(method, pairs);
  } catch (const ListsTooLong& lists) {
    reportTooLong(lists);
    stats_.method = method = dParallelSAPMethodSweep;
    extractBy(method, pairs);
  }
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
  if (settings.method == dParallelSAPMethodAuto && method == dParallelSAPMethodSweep &&
      MethodChoice::isCrowd(geoms_.size(), stats_.pairs) && extractCrowd(pairs))
    return;
  stats_.threads = std::max(stats_.threads,
                            finders().of(method, boxes_.wide).find(boxes_, frame_threads_, pairs));
  if (method == dParallelSAPMethodSweep) method_choice_.learn(finders().keptCells(boxes_.wide));
}

// A scene that was a crowd in the last frame. False where it is none any more.
bool ParallelSAPSpace::extractCrowd(PairList& pairs) {
  const int used =
      finders().findCrowd(boxes_, frame_threads_, MethodChoice::places_of_a_pair, pairs);
  if (used == 0) return false;
  stats_.method = dParallelSAPMethodBruteForce;
  stats_.threads = std::max(stats_.threads, used);
  return true;
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
  dParallelSAPStats own = {};
  own.frames = stats_.frames;
  own.geoms = count;
  own.backend = dParallelSAPBackendCPU;
  own.method = dParallelSAPMethodBruteForce;
  own.threads = 1;
  own.moved = cleanOneByOne();
  for (dxGeom* geom = first; geom; geom = geom->next) {
    const bool invalid = isEnabled(geom) && hasNaN(geom);
    own.disabled += !isEnabled(geom);
    own.invalid += invalid;
    own.unbounded += isEnabled(geom) && !invalid && isUnbounded(geom);
  }
  stats_ = own;  // should the callback throw
  for (dxGeom* a = first; a; a = a->next) {
    if (!isEnabled(a) || hasNaN(a)) continue;
    for (dxGeom* b = a->next; b; b = b->next) {
      if (!isEnabled(b) || hasNaN(b)) continue;
      if (!pairsExactly(a, b) || isLeftOut(a, b, settings.rules)) continue;
      ++own.candidates;
      if (!passesAABBTests(a, b)) continue;
      ++own.pairs;
      callback(data, a, b);
    }
  }
  own.frames = stats_.frames;
  stats_ = own;
}

}  // namespace ode_parallel_sap
