#include "space/cache/fat_proxies.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

// fixed: one box in so many is followed, which is 1 % of a frame, and no more than show whether an
// eighth of all is fast.
constexpr std::size_t sampled_share = 16;
constexpr std::size_t most_sampled = 128;  // fixed: likewise

// A round number: larger boxes are of no use where more than one box in so many is fast, nor where
// twice as many have left theirs.
constexpr std::size_t changing_share = 8;

// Frames in which a box at a steady speed stays in margins of that share, if that is of use.
constexpr float servedBy(float share) {
  return least_service * share / fat_shares[0];
}
// What left its fat box gets these margins.
constexpr float widest_share = fat_shares[std::size(fat_shares) - 1];

Region leaving("fat proxies: boxes"), fattening("fat proxies: fat boxes"),
    testing("fat proxies: candidates");

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
  for (int axis = 0; axis < 3; ++axis)
    distance = std::max({distance, std::fabs(a.lower[axis] - b.lower[axis]),
                         std::fabs(a.upper[axis] - b.upper[axis])});
  return distance;
}

// How far a bound of a fat box may lie outside that of its box, as a part of the tolerance. Two
// such margins are less than the tolerance by more than floats are rounded by (exceedsTolerance).
constexpr float most_loose = 7.0f / 16;  // fixed: less than a half

Box grown(const Box& box, float margin) {
  Box grown;
  for (int axis = 0; axis < 3; ++axis) {
    grown.lower[axis] = box.lower[axis] - margin;
    grown.upper[axis] = box.upper[axis] + margin;
  }
  return grown;
}

}  // namespace

// Each bound rounded.
Box FatProxies::movedBack(const Box& box, const Box& move) {
  Box moved;
  for (int axis = 0; axis < 3; ++axis) {
    moved.lower[axis] = box.lower[axis] - move.lower[axis];
    moved.upper[axis] = box.upper[axis] - move.upper[axis];
  }
  return moved;
}

// What the moves of boxes since the sample was taken have in common: on each axis their median, if
// nearly all go in one direction, by whatever distance, else 0. No move where more boxes stay in
// their margins without it.
Box FatProxies::sharedMove(const BoxSet& boxes) const {
  Box shared = {};
  bool any = false;
  for (int axis = 0; axis < 3; ++axis) {
    float moves[most_sampled];
    std::size_t count = 0, up = 0, down = 0;
    for (const Sampled& of : sample_) {
      const float move = boxes.boxes[of.slot].lower[axis] - of.first.lower[axis];
      if (!std::isfinite(move)) continue;
      moves[count++] = move;
      up += move > 0, down += move < 0;
    }
    if ((count - std::max(up, down)) * changing_share >= count) continue;
    std::nth_element(moves, moves + count / 2, moves + count);
    shared.lower[axis] = shared.upper[axis] = moves[count / 2];
    any = true;
  }
  if (!any) return shared;
  std::size_t with = 0, without = 0;
  for (const Sampled& of : sample_) {
    const Box& box = boxes.boxes[of.slot];
    const float margin = marginOf(box, widest_share);
    with += distanceOf(of.first, movedBack(box, shared)) > margin;
    without += distanceOf(of.first, box) > margin;
  }
  return with <= without ? shared : Box{};
}

// Goes on with the sample, or takes one if the last is of other slots. Returns whether it goes on.
bool FatProxies::followSample(const BoxSet& boxes) {
  // The same slots again, while about as many are there: some come and go in every frame.
  const std::size_t reach = sample_.size() * sample_step_;
  const bool known = reach <= boxes.size && boxes.size < 2 * reach;
  sampled_frames_ = known ? sampled_frames_ + 1 : 0;
  if (known) return true;
  restartMove();
  sample_.resizeDiscarding(std::min(most_sampled, boxes.size / sampled_share));
  sample_step_ = boxes.size / std::max<std::size_t>(sample_.size(), 1);
  for (std::size_t k = 0; k < sample_.size(); ++k) {
    // Anywhere in its step: slots that programs fill alike often lie even distances apart.
    const std::size_t within = (static_cast<std::uint32_t>(k) * 0x9e3779b9u >> 16) % sample_step_;
    const Slot slot = static_cast<Slot>(k * sample_step_ + within);
    sample_[k] = {slot, boxes.boxes[slot], boxes.boxes[slot], 0};
  }
  return false;
}

// The sample is of the boxes of now: what they moved since fat boxes were made counts as before it.
void FatProxies::restartMove() {
  at_start_ = movedBack({}, moved());
  since_sample_ = {};
}

// Finds the least margins in which nearly all boxes of a sample have stayed since it was taken, and
// in which they would stay for long enough if they went on. Returns the tolerance where they moved
// so little since the last frame that they would stay within its margins, or none can be compared,
// else 0.
float FatProxies::usefulTolerance(const BoxSet& boxes, double tolerance) {
  // At infinity a margin would be infinite, and make no number of an infinite bound.
  constexpr double most = std::numeric_limits<float>::max();
  const float useful = static_cast<float>(std::min(tolerance, most));
  share_ = useful > 0 ? fat_shares[0] : 0;
  if (!followSample(boxes)) return useful;
  since_sample_ = sharedMove(boxes);
  const float frames = static_cast<float>(sampled_frames_);
  const std::size_t margins = boxes.size > far_slots / 2 ? 1 : std::size(fat_shares);
  std::size_t compared = 0, left = 0, fast[std::size(fat_shares)] = {}, fast_for_tolerance = 0;
  for (auto& [slot, first, last, farthest] : sample_) {
    const Box& box = boxes.boxes[slot];
    if (isActive(box) && isActive(last)) {
      farthest = std::max(farthest, distanceOf(first, movedBack(box, since_sample_)));
      ++compared;
      for (std::size_t i = 0; i < margins; ++i)
        fast[i] += !(farthest * std::max(1.0f, servedBy(fat_shares[i]) / frames) <=
                     marginOf(box, fat_shares[i]));
      left += !(farthest <= marginOf(box, fat_shares[margins - 1]));
      fast_for_tolerance += !(distanceOf(last, box) <= useful * most_loose / 2);
    } else {
      first = movedBack(box, since_sample_);
      farthest = 0;
    }
    last = box;
  }
  // A sample of which too many are out of all margins would be of no use any more.
  if (frames >= servedBy(fat_shares[margins - 1]) || left * changing_share > compared) {
    for (Sampled& of : sample_) of = {of.slot, of.last, of.last, 0};
    sampled_frames_ = 0;
    restartMove();
  }
  if (compared == 0) return useful;
  if (useful > 0 && fast_for_tolerance * changing_share <= compared) return useful;
  share_ = 0;
  for (std::size_t i = margins; i-- > 0;)
    if (fast[i] * changing_share <= compared) share_ = fat_shares[i];
  return 0;
}

Box FatProxies::moved() const {
  return movedBack(since_sample_, at_start_);
}

bool FatProxies::filtersChanged(const BoxSet& boxes, Slot slot) const {
  if (!isActive(boxes.boxes[slot]) || !isActive(fat_.boxes[slot])) return false;
  const FilterBits &now = boxes.bits[slot], &then = fat_.bits[slot];
  return (boxes.filter_bits && (now.category != then.category || now.collide != then.collide)) ||
         (boxes.filter_bodies && boxes.bodies[slot] != fat_.bodies[slot]);
}

// Finds what belongs into left_.
void FatProxies::listLeft(const BoxSet& boxes, int threads) {
  constexpr std::size_t word_slots = SlotSet::word_slots;
  const std::size_t both = std::min(boxes.size, fat_.size);
  const std::size_t any = std::max(boxes.size, fat_.size);
  const std::size_t words = (both + word_slots - 1) / word_slots;
  left_.growTo(any);
  for (std::size_t word = words; word < left_.words(); ++word) left_.setWord(word, 0);
  const KernelSet& kernel = kernelSet();
  const Box move = moved();
  const bool filters = boxes.filter_bits || boxes.filter_bodies;
  runTeam(leaving, teamFor(words, grains::cells, threads), [&](int thread, int team) {
    const Range own = ownPart(words, thread, team);
    for (std::size_t word = own.begin; word < own.end; ++word) {
      const std::size_t first = word * word_slots, count = std::min(both - first, word_slots);
      std::uint64_t bits =
          kernel.boxesOutside(&boxes.boxes[first], move, &fat_.boxes[first], count);
      for (std::size_t i = 0; filters && i < count; ++i)
        bits |= std::uint64_t{filtersChanged(boxes, static_cast<Slot>(first + i))} << i;
      if (tolerance_ > 0) {
        // Fat boxes that are too loose, or whose boxes are there no more.
        Box most[word_slots];
        for (std::size_t i = 0; i < count; ++i)
          most[i] = grown(boxes.boxes[first + i], tolerance_ * most_loose);
        bits |= kernel.boxesOutside(&fat_.boxes[first], Box{}, most, count);
      }
      left_.setWord(word, bits);
    }
  });
  for (std::size_t slot = both; slot < any; ++slot) left_.insert(static_cast<Slot>(slot));
}

bool FatProxies::prepare(const BoxSet& boxes, double tolerance, int threads) {
  const ScopedMode mode(exactMode());
  const float before = std::exchange(tolerance_, usefulTolerance(boxes, tolerance));
  if (tolerance_ > 0) at_start_ = since_sample_;
  if (before != tolerance_) {
    stop();
    back_off_ = BackOff(4);
  }
  if (back_off_.skipTurn()) return false;
  if (fat_.size == 0) return share_ > 0;
  // Candidates are of use if so few boxes left their fat ones: half of what is found anew as fast.
  if (fat_.filter_bits == boxes.filter_bits && fat_.filter_bodies == boxes.filter_bodies) {
    listLeft(boxes, threads);
    if (2 * left_.count() * changing_share <= boxes.size) {
      if (frames_ >= least_service / 2) back_off_.paid();
      return true;
    }
  }
  const bool too_soon = frames_ < least_service / 2;
  stop();
  if (too_soon) back_off_.failed();
  return share_ > 0 && !too_soon;
}

void FatProxies::noteUnused() {
  constexpr int held_frames = 64;  // fixed: a second of a program's
  if (fat_.boxes.capacity() == 0 || ++unused_ <= held_frames) return;
  stop();
  fat_ = BoxSet();
  candidates_ = PairList();
  changed_pairs_ = ChangedPairs();
}

// Keeps the storage for the next start.
void FatProxies::stop() {
  fat_.size = 0;
}

// Also takes over the filters.
void FatProxies::fatten(const BoxSet& boxes, Slot slot, float share) {
  const Box box = movedBack(boxes.boxes[slot], moved());
  fat_.boxes[slot] =
      grown(box, tolerance_ > 0 ? tolerance_ * most_loose / 2 : marginOf(box, share));
  if (boxes.filter_bits) fat_.bits[slot] = boxes.bits[slot];
  if (boxes.filter_bodies) fat_.bodies[slot] = boxes.bodies[slot];
}

int FatProxies::start(const BoxSet& boxes, int threads, Sweep<float>& sweep) {
  frames_ = 0;
  stray_rows_ = 0;
  at_start_ = since_sample_;
  fat_.filter_bits = boxes.filter_bits;
  fat_.filter_bodies = boxes.filter_bodies;
  fat_.exact = true;  // of candidates none is borderline
  fat_.resize(boxes.size);
  const int most = teamFor(boxes.size, grains::slots, threads);
  runTeam(fattening, most, [&](int thread, int team) {
    const Range own = ownPart(boxes.size, thread, team);
    for (std::size_t slot = own.begin; slot < own.end; ++slot)
      fatten(boxes, static_cast<Slot>(slot), share_);
  });
  return sweep.find(fat_, threads, candidates_);
}

// Boxes that have left get fat ones with more room: they may be on their way. Their pairs are found
// in the sweep's trees, which are made anew once the strays in them have cost as much.
int FatProxies::follow(const BoxSet& boxes, int threads, Sweep<float>& sweep) {
  ++frames_;
  left_.listBelow(boxes.size, leaving_);
  kept_ = candidates_.size();
  if (leaving_.size() == 0 && fat_.size == boxes.size) return 1;
  fat_.resize(boxes.size);
  for (const Slot slot : leaving_) fatten(boxes, slot, widest_share);
  CellTrees<float>& trees = sweep.trees();
  if (sweep.holds(fat_) && stray_rows_ <= build_cost * static_cast<double>(boxes.size)) {
    trees.numberPlaces(threads);
    for (const Slot slot : leaving_) trees.place(slot, fat_.boxes[slot]);
  } else {
    Buffer<std::uint64_t> workspace;
    sweep.build(fat_, threads, workspace);
    stray_rows_ = 0;
  }
  stray_rows_ += static_cast<double>(leaving_.size() * trees.strayRows());
  const int used = changed_pairs_.find(fat_, /*all_active=*/true, leaving_, left_, threads,
                                       /*test=*/nullptr, [&](Slot slot, Buffer<Slot>& hits) {
                                         hits.resizeDiscarding(trees.most());
                                         hits.resize(trees.find(fat_.boxes[slot], hits.data()));
                                         for (Slot& hit : hits) hit /= 2;
                                       });
  kept_ = changed_pairs_.replace(left_, threads, candidates_);
  return used;
}

// Each part of the list has the pairs of an equal part of the candidates. Within a tolerance they
// are pairs as they are.
int FatProxies::testCandidates(const BoxSet& boxes, int threads, const PairTest& test,
                               PairList& pairs) {
  constexpr int parts_a_thread = 4;  // a round number: each part costs the report a little
  const std::size_t count = candidates_.size();
  const int parts =
      teamFor(count, grains::tested_pairs, threads > 1 ? parts_a_thread * threads : 1);
  const KernelSet& kernel = kernelSet();
  pairs.clear(static_cast<std::size_t>(parts));
  const auto testPart = [&](const Range& numbers, int) {
    const Range places = partOf(count, static_cast<int>(numbers.begin), parts);
    Buffer<Pair>& part = pairs.parts[numbers.begin];
    std::size_t kept = 0;
    // It grows with the pairs. The first part has room from plain frames.
    part.reserve((places.end - places.begin) / 2);
    PairCursor(candidates_)
        .read(places.begin, places.end, [&](const Pair* run, const Pair* run_end) {
          while (run < run_end) {
            const std::size_t chunk = std::min<std::size_t>(chunk_pairs, run_end - run);
            part.resize(kept + chunk);
            Pair *const to = part.data() + kept, *end = to;
            bool is_open = test.everyPair();
            if (tolerance_ > 0)
              end = std::copy(run, run + chunk, to);
            else
              is_open |= kernel.keptPairs(boxes.boxes.data(), run, chunk, boxes.exact, end);
            if (is_open) end = test.keep(to, end);
            kept += static_cast<std::size_t>(end - to);
            run += chunk;
          }
        });
    part.resize(kept);
  };
  const int team = std::min(parts, threads);
  const int used = runChunks(testing, team, static_cast<std::size_t>(parts), 1, testPart, team);
  pairs.addParts(/*decided=*/true);
  return used;
}

int FatProxies::find(const BoxSet& boxes, int threads, Sweep<float>& sweep, const PairTest& test,
                     PairList& pairs) {
  const ScopedMode mode(exactMode());
  kept_ = unused_ = 0;
  const int used = fat_.size > 0 ? follow(boxes, threads, sweep) : start(boxes, threads, sweep);
  return std::max(used, testCandidates(boxes, threads, test, pairs));
}

}  // namespace ode_parallel_sap
