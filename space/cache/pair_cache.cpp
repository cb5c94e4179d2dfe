#include "space/cache/pair_cache.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "space/cache/tuning.h"
#include "space/data/floating_point.h"
#include "space/data/mechanisms.h"
#include "space/data/parallel.h"
#include "space/data/tuning.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

// fixed: one box in so many is followed, which is 1 % of a frame, and no more than show whether an
// eighth of all is fast.
constexpr std::size_t sampled_share = 16;
constexpr std::size_t most_sampled = 128;  // fixed: likewise

Region leaving("pair cache: boxes"), fattening("pair cache: fat boxes"),
    testing("pair cache: candidates");

// A share of the least extent: a long bar needs no room as if it were so thick. 0 for a box that
// has no such extent, or is bounded on no axis.
float marginOf(const Box& box, float share) {
  float least = box.upper[0] - box.lower[0];
  for (int axis = 1; axis < 3; ++axis) least = std::min(least, box.upper[axis] - box.lower[axis]);
  return least > 0 && least <= std::numeric_limits<float>::max() ? least * share : 0;
}

// The greatest distance of a bound of one from that of the other.
float distanceOf(const Box& a, const Box& b) {
  float distance = 0;
  for (int axis = 0; axis < 3; ++axis) {
    distance = std::max(distance, std::fabs(a.lower[axis] - b.lower[axis]));
    distance = std::max(distance, std::fabs(a.upper[axis] - b.upper[axis]));
  }
  return distance;
}

void resizeTo(std::size_t slots, BoxSet& fat) {
  fat.size = slots;
  fat.boxes.resize(slots);
  fat.bits.resize(slots);
  fat.bodies.resize(slots);
}

}  // namespace

void PairCache::beginFrame(bool nested) {
  if (!complete_ || nested) running_ = false;
  complete_ = false;
}

void PairCache::start(std::size_t slots, bool on_device, bool in_trees) {
  running_ = true;
  all_may_have_changed_ = false;
  changed_.growTo(slots);
  source_ = on_device ? Source::device : in_trees ? Source::trees : Source::no_trees;
  if (in_trees_ == Proxies::boxes) in_trees_ = Proxies::none;
}

// Sees without going through the slots that nothing was noted, and that there is nothing to look
// at.
bool PairCache::isPlainlySame(const PackRules& rules, const GeomUpdate& geom_update) const {
  return mechanisms::plainly_same_frames && !any_changed_ && !all_may_have_changed_ &&
         !rules.checked && source_ != Source::device && geom_update.watchesNone();
}

// Small scenes are found anew faster than changes in trees that would have to be built.
bool PairCache::tooMany(std::size_t changes, std::size_t slots) const {
  const bool may_build =
      mechanisms::incremental_trees && (source_ != Source::no_trees || slots > smallest_scene);
  return changes * changing_share > slots || (changes > 0 && !may_build);
}

PairCache::Update PairCache::update(dxGeom* const* geoms, std::size_t slots, const PackRules& rules,
                                    int threads, GeomUpdate& geom_update, BoxSet& boxes) {
  Update update;
  was_plainly_same_ = false;
  const bool same_rules = rules == rules_;
  rules_ = rules;
  if (!running_ || !same_rules || !geom_update.canRepack()) return update;
  if (isPlainlySame(rules, geom_update)) {
    was_plainly_same_ = update.kept = true;
    geom_update.keepAll();
    return update;
  }
  // Within a tolerance most of what moved may turn out to stay.
  const bool some_may_stay = rules.tolerance > 0;
  if (!some_may_stay && tooMany(changed_.count(), slots)) return update;
  changed_.growTo(slots);
  bool all = std::exchange(all_may_have_changed_, false);
  if (rules.notified && rules.checked && !all) {
    update.untold = geom_update.findUntold(geoms, boxes, changed_);
    all = update.untold.count > 0;
  }
  update.threads = geom_update.notice(geoms, slots, threads, boxes, all, changed_);
  // Slots that are gone are in none of the boxes, but in pairs.
  update.changes = changed_.count();
  if (!some_may_stay && tooMany(update.changes, slots)) return update;
  const bool fits =
      geom_update.repack(geoms, slots, slots / changing_share, threads, changed_, boxes);
  if (some_may_stay) update.changes = changed_.count();
  update.kept = fits && !tooMany(update.changes, slots);
  if (update.kept)
    any_changed_ = update.changes > 0;
  else
    update.moved_in_vain = geom_update.facts().moved;
  return update;
}

template <class Real>
int PairCache::findChanged(ProxyTrees<Real>& trees, Sweep<Real>& base, const Buffer<Slot>& changed,
                           const BoxSet& boxes, int threads) {
  if (in_trees_ != Proxies::boxes) {
    if (source_ != Source::trees) base.build(boxes, threads);
    trees.start(base, changed_.words() * SlotSet::word_slots, boxes);
    in_trees_ = Proxies::boxes;
  }
  return trees.find(boxes, changed, threads, found_);
}

PairCache::Counts PairCache::renew(dxGeom* const* geoms, const Update& update,
                                   const GeomUpdate& geom_update, const BoxSet& boxes, int threads,
                                   CPUFinders& finders, PairFilter& filter, PairList& pairs) {
  Counts counts = {update.threads, 0, pairs.size()};
  if (update.changes == 0) return counts;
  const Buffer<Slot>& changed = geom_update.repacked();
  const int used =
      boxes.wide ? findChanged(wide_trees_, finders.wide.sweep, changed, boxes, threads)
                 : findChanged(trees_, finders.narrow.sweep, changed, boxes, threads);
  counts.threads = std::max(counts.threads, used);
  counts.found = found_.size();
  filter.run(geoms, geom_update.facts(), rules_, boxes, threads, found_);
  counts.kept = merge_.replace(changed_, found_, threads, pairs);
  forgetChanges();
  return counts;
}

// Whether nearly all of a sample of the boxes have moved so little since the last one that they
// would stay in fat ones for a while. Takes the next sample.
bool PairCache::isSlow(const BoxSet& boxes) {
  const std::size_t count = std::min(most_sampled, boxes.size / sampled_share);
  const bool known = sampled_ == boxes.size;
  sampled_ = boxes.size;
  if (count == 0) return false;
  const std::size_t step = boxes.size / count;
  sample_.resizeDiscarding(count);
  std::size_t compared = 0, fast = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Box& box = boxes.boxes[i * step];
    Box& before = sample_[i];
    if (known && isActive(box) && isActive(before)) {
      ++compared;
      fast += !(distanceOf(before, box) * least_service <= marginOf(box, fat_share));
    }
    before = box;
  }
  return compared > 0 && fast * changing_share <= compared;
}

bool PairCache::filtersChanged(const BoxSet& boxes, Slot slot) const {
  const FilterBits &now = boxes.bits[slot], &then = fat_.bits[slot];
  return (boxes.filter_bits && (now.category != then.category || now.collide != then.collide)) ||
         (boxes.filter_bodies && boxes.bodies[slot] != fat_.bodies[slot]);
}

// Finds what belongs into left_.
void PairCache::listLeft(const BoxSet& boxes, int threads) {
  constexpr std::size_t word_slots = SlotSet::word_slots;
  const std::size_t both = std::min(boxes.size, fat_.size);
  const std::size_t any = std::max(boxes.size, fat_.size);
  const std::size_t words = (both + word_slots - 1) / word_slots;
  left_.growTo(any);
  for (std::size_t word = words; word < left_.words(); ++word) left_.setWord(word, 0);
  const KernelSet& kernel = kernelSet();
  const bool filters = boxes.filter_bits || boxes.filter_bodies;
  runTeam(leaving, teamFor(words, grains::box_rows, threads), [&](int thread, int team) {
    const Range own = ownPart(words, thread, team);
    for (std::size_t word = own.begin; word < own.end; ++word) {
      const std::size_t first = word * word_slots, count = std::min(both - first, word_slots);
      std::uint64_t bits = kernel.boxesOutside(&boxes.boxes[first], &fat_.boxes[first], count);
      for (std::size_t i = 0; filters && i < count; ++i)
        bits |= std::uint64_t{filtersChanged(boxes, static_cast<Slot>(first + i))} << i;
      left_.setWord(word, bits);
    }
  });
  for (std::size_t slot = both; slot < any; ++slot) left_.insert(static_cast<Slot>(slot));
}

PairCache::Fat PairCache::judgeFat(const BoxSet& boxes, int threads, const Sweep<float>& sweep) {
  const ScopedMode mode(exactMode());
  fat_skipped_ = 0;
  const bool slow = isSlow(boxes);
  if (fat_running_ && fat_.filter_bits == boxes.filter_bits &&
      fat_.filter_bodies == boxes.filter_bodies) {
    listLeft(boxes, threads);
    const std::size_t count = left_.count();
    // Half of what is found anew as quickly without fat boxes. Others may have made trees of boxes
    // that are not these.
    if (count == 0 || (2 * count * changing_share <= boxes.size && builds_ == sweep.builds()))
      return Fat::served;
  }
  const bool in_vain = fat_running_ && fat_frames_ == 0;
  stopFat();
  if (in_vain) return Fat::in_vain;
  return slow ? Fat::started : Fat::off;
}

bool PairCache::usesFat(const BoxSet& boxes, int threads, const Sweep<float>& sweep) {
  if (fat_back_off_.waits()) {
    skipFat();
    fat_back_off_.pass();
    return false;
  }
  const Fat fat = judgeFat(boxes, threads, sweep);
  if (fat == Fat::in_vain) fat_back_off_.failed();
  if (fat == Fat::served) fat_back_off_.paid();
  return fat == Fat::started || fat == Fat::served;
}

void PairCache::skipFat() {
  // fixed: a second of a program's. To make all anew costs half a frame.
  constexpr int held_frames = 64;
  if (fat_running_ && ++fat_skipped_ > held_frames) stopFat();
}

void PairCache::stopFat() {
  if (!fat_running_) return;
  fat_running_ = false;
  fat_ = BoxSet();
  candidates_ = found_ = PairList();
  merge_ = PairMerge();
  if (in_trees_ != Proxies::fat) return;
  trees_ = ProxyTrees<float>();
  in_trees_ = Proxies::none;
}

// Also takes over the filters.
void PairCache::fatten(const BoxSet& boxes, Slot slot, float share) {
  const Box& box = boxes.boxes[slot];
  Box& fat = fat_.boxes[slot];
  const float margin = marginOf(box, share);
  for (int axis = 0; axis < 3; ++axis) {
    fat.lower[axis] = box.lower[axis] - margin;
    fat.upper[axis] = box.upper[axis] + margin;
  }
  fat_.bits[slot] = boxes.bits[slot];
  fat_.bodies[slot] = boxes.bodies[slot];
}

int PairCache::startFat(const BoxSet& boxes, int threads, Sweep<float>& sweep) {
  fat_running_ = true;
  fat_frames_ = 0;
  fat_.filter_bits = boxes.filter_bits;
  fat_.filter_bodies = boxes.filter_bodies;
  fat_.exact = true;  // of candidates none is borderline
  resizeTo(boxes.size, fat_);
  const int most = teamFor(boxes.size, grains::packed_slots, threads);
  runTeam(fattening, most, [&](int thread, int team) {
    const Range own = ownPart(boxes.size, thread, team);
    for (std::size_t slot = own.begin; slot < own.end; ++slot)
      fatten(boxes, static_cast<Slot>(slot), fat_share);
  });
  const int used = sweep.find(fat_, threads, candidates_);
  builds_ = sweep.builds();
  return used;
}

// Boxes that have left get fat ones with more room: they may be on their way.
int PairCache::followFat(const BoxSet& boxes, int threads, Sweep<float>& sweep, Counts& counts) {
  ++fat_frames_;
  leaving_.resizeDiscarding(0);
  left_.forEach([&](Slot slot) {
    if (slot < boxes.size) leaving_.push_back(slot);
  });
  counts.kept = candidates_.size();
  if (leaving_.size() == 0 && fat_.size == boxes.size) return 1;
  if (in_trees_ != Proxies::fat) {
    trees_.start(sweep, fat_.size, fat_);
    in_trees_ = Proxies::fat;
  }
  resizeTo(boxes.size, fat_);
  for (const Slot slot : leaving_) fatten(boxes, slot, 2 * fat_share);
  const int used = trees_.find(fat_, leaving_, threads, found_);
  builds_ = sweep.builds();
  counts.kept = merge_.replace(left_, found_, threads, candidates_);
  return used;
}

// Each thread tests a part of the candidates, and notes what is borderline while it is in the
// cache.
int PairCache::test(const BoxSet& boxes, int threads, PairList& pairs) {
  const std::size_t count = candidates_.size();
  const int most = teamFor(count, grains::tested_candidates, threads);
  const KernelSet& kernel = kernelSet();
  pairs.clear(static_cast<std::size_t>(most));
  if (borderline_.size() < static_cast<std::size_t>(most)) borderline_.resize(most);
  for (auto& list : borderline_) list.clear();
  const int used = runTeam(testing, most, [&](int thread, int team) {
    const std::size_t number = static_cast<std::size_t>(thread);
    const Range own = ownPart(count, thread, team);
    Buffer<Pair>& part = pairs.parts[number];
    part.resizeDiscarding(own.end - own.begin);
    std::size_t written = 0;
    PairCursor(candidates_).read(own.begin, own.end, [&](const Pair* run, const Pair* run_end) {
      while (run < run_end) {
        const std::size_t chunk = std::min<std::size_t>(chunk_pairs, run_end - run);
        const std::size_t first = written;
        written += kernel.keptPairs(boxes.boxes.data(), run, chunk, boxes.exact, &part[first]);
        run += chunk;
        if (!boxes.exact)
          noteBorderline(part.data(), {number, first, written}, borderline_[number]);
      }
    });
    part.resize(written);
  });
  for (const auto& list : borderline_)
    pairs.borderline.insert(pairs.borderline.end(), list.begin(), list.end());
  return used;
}

PairCache::Counts PairCache::findFat(const BoxSet& boxes, int threads, Sweep<float>& sweep,
                                     PairList& pairs) {
  const ScopedMode mode(exactMode());
  try {
    Counts counts;
    counts.threads = fat_running_ ? followFat(boxes, threads, sweep, counts)
                                  : startFat(boxes, threads, sweep);
    counts.threads = std::max(counts.threads, test(boxes, threads, pairs));
    counts.found = pairs.size();
    return counts;
  } catch (...) {
    stopFat();
    throw;
  }
}

}  // namespace ode_parallel_sap
