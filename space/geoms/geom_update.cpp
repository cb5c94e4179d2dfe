#include "space/geoms/geom_update.h"

#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/platform.h"
#include "space/base/round_to_floats.h"
#include "space/base/tuning.h"
#include "space/geoms/geom_tests.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

Region updating("update: geoms"), comparing("update: silent changes");

// True for most geoms that did not change silently, and for no others. Not for rules by which geoms
// rest.
bool isPlainlySame(const dxGeom* geom, Slot slot, SlotState state, const BoxSet& boxes) {
  return !(state & (disabled_state | no_box_state | space_state)) &&
         (geom->gflags & GEOM_ENABLE_TEST_MASK) == GEOM_ENABLE_TEST_VALUE &&
         hasBitsOf(geom, slot, boxes) && boxes.bodies[slot] == keyOf(geom->body);
}

// The reader of boxes learns that the frame will not find their pairs.
struct ForgetUnlessDone {
  BoxReader* reader;
  ~ForgetUnlessDone() {
    if (reader) reader->forget();
  }
};

// For forGeoms(): the slots from a first one on, and those of a list.
auto slotsFrom(std::size_t first) {
  return [first](std::size_t i) { return first + i; };
}
auto slotsOf(const Buffer<Slot>& list) {
  return [slots = list.data()](std::size_t i) { return std::size_t{slots[i]}; };
}

}  // namespace

// In the order of their lower bounds on the axis on which these differ most. No order of slots
// shows in multiples of the golden ratio.
void CoarseBoxes::take(dxGeom* const* geoms, const Buffer<SlotState>& states, std::size_t coarse) {
  const double share =
      std::min(1.0, static_cast<double>(most_sampled) / static_cast<double>(coarse));
  const auto limit = static_cast<std::uint32_t>(share * 0xffffffffu);
  sample_.clear();
  for (std::size_t slot = 0; slot < states.size(); ++slot) {
    if (!(states[slot] & coarse_state) || static_cast<Slot>(slot) * 0x9e3779b9u > limit) continue;
    sample_.push_back({{}, geoms[slot]});
    roundToFloats(geoms[slot]->aabb, sample_.back().box);
  }
  if (sample_.empty()) return;
  float widest = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax_element(
        sample_.begin(), sample_.end(),
        [=](const Sampled& a, const Sampled& b) { return a.box.lower[axis] < b.box.lower[axis]; });
    const float width = most->box.lower[axis] - least->box.lower[axis];
    if (!(width > widest)) continue;
    widest = width;
    axis_ = axis;
  }
  std::sort(sample_.begin(), sample_.end(), [this](const Sampled& a, const Sampled& b) {
    return a.box.lower[axis_] < b.box.lower[axis_];
  });
}

bool CoarseBoxes::overlapFalsely(dxGeom* const* geoms, const Buffer<SlotState>& states,
                                 std::size_t coarse, std::size_t most) {
  if (answer_ && !areManyMore(coarse) && ++age_ < retry_frames) return true;
  age_ = 0;
  sampled_of_ = coarse;
  answer_ = false;
  if (coarse * coarse / 2 <= most) return false;
  const ScopedMode exact(exactMode());
  take(geoms, states, coarse);
  const double share = static_cast<double>(sample_.size()) / static_cast<double>(coarse);
  const double most_sampled_pairs = static_cast<double>(most) * share * share;
  std::size_t false_pairs = 0;
  for (auto a = sample_.begin(); a != sample_.end(); ++a)
    for (auto b = a + 1; b != sample_.end() && b->box.lower[axis_] <= a->box.upper[axis_]; ++b) {
      false_pairs += overlap(a->box, b->box) && !boxesOverlap(a->geom, b->geom);
      if (static_cast<double>(false_pairs) > most_sampled_pairs) return answer_ = true;
    }
  return false;
}

// A part of forGeoms(), in blocks. In a large scene the next geoms are prefetched.
// Geoms that are the calling thread's business are deferred.
template <class SlotAt, class Use>
void GeomUpdate::forPart(dxGeom* const* const geoms, const std::size_t count, SlotAt slotAt,
                         const Range range, Use use, UpdatePart& part) {
  constexpr std::size_t ahead = prefetch_distance / 2;
  constexpr Slot cached = 4096;  // fixed: geoms in a second-level cache of 2 MB
  const bool is_large = count > 0 && slotAt(count - 1) >= cached;
  for (std::size_t begin = range.begin; begin < range.end; begin += prefetch_distance) {
    const std::size_t end = std::min(begin + prefetch_distance, range.end);
    for (std::size_t i = begin; i < end && is_large; ++i) {
      if (const dxGeom* const later = i + ahead < range.end ? geoms[slotAt(i + ahead)] : nullptr)
        prefetchState(later);
      const dxGeom* const geom = geoms[slotAt(i)];
      if (geom && geom->gflags & GEOM_DIRTY) prefetchPose(geom);
      if (geom) prefetch(geom->aabb);
    }
    for (std::size_t i = begin; i < end; ++i) {
      dxGeom* const geom = geoms[slotAt(i)];
      if (!geom || !(geom->gflags & GEOM_DIRTY)) continue;
      ++part.facts.moved;
      if (needsCallingThread(geom))
        part.deferred.push_back(static_cast<Slot>(slotAt(i)));
      else
        cleanOwn(geom);
    }
    const ScopedMode exact(exactMode());
    for (std::size_t i = begin; i < end; ++i) {
      const dxGeom* const geom = geoms[slotAt(i)];
      if (!geom || !(geom->gflags & GEOM_DIRTY)) use(geom, static_cast<Slot>(slotAt(i)), part);
    }
  }
}

// Brings the geoms of slotAt(0) to slotAt(count - 1), which ascend, up to date. Calls use(geom,
// slot, part) for each; geom may be null.
template <class SlotAt, class Use>
int GeomUpdate::forGeoms(dxGeom* const* geoms, std::size_t count, SlotAt slotAt, int threads,
                         Use use) {
  const std::size_t chunk = taskSize(count, threads), chunks = (count + chunk - 1) / chunk;
  parts_.resize(chunks + 1);  // the last one is the calling thread's
  for (UpdatePart& part : parts_) {
    part.facts = UpdateFacts();
    part.deferred.clear();
  }
  const int used = runChunks(
      updating, threads, count, chunk,
      [&](const Range& range, int) {
        forPart(geoms, count, slotAt, range, use, parts_[range.begin / chunk]);
      },
      threads);
  for (std::size_t part = 0; part < chunks; ++part)
    for (const Slot slot : parts_[part].deferred) {
      cleanGeom(geoms[slot]);
      const ScopedMode exact(exactMode());
      use(geoms[slot], slot, parts_[chunks]);
    }
  return used;
}

void GeomUpdate::clean(dxGeom* const* geoms, std::size_t slots, int threads,
                       const SlotSet* changed) {
  const auto nothing = [](const dxGeom*, Slot, UpdatePart&) {};
  if (!changed) return void(forGeoms(geoms, slots, slotsFrom(0), threads, nothing));
  changed->listBelow(slots, slots_);
  forGeoms(geoms, slots_.size(), slotsOf(slots_), threads, nothing);
}

int GeomUpdate::pack(dxGeom* const* geoms, std::size_t slots, const PairRules& rules, int threads,
                     BoxReader* reader) {
  packer_.rules = rules;
  watching_ = false;
  boxes_.size = slots;
  boxes_.bits.resizeDiscarding(slots);
  facts_.exact_bits ? boxes_.wide_bits.release() : boxes_.wide_bits.resizeDiscarding(slots);
  boxes_.bodies.resizeDiscarding(slots);
  states_.resizeDiscarding(slots);
  std::size_t moved = 0;
  // Devices read boxes while others are packed: 7/8 of those that are left at a time, as to pack
  // one takes ten times as long as to read it. Round numbers; so many boxes are read in 4 us.
  constexpr std::size_t unread_share = 8, least_unread_boxes = 8192;
  const std::size_t least_unread = teamsAreTested() ? 1 : least_unread_boxes;
  if (slots / unread_share < least_unread) reader = nullptr;
  ForgetUnlessDone reading{reader};
  for (bool repeated = false;; repeated = true) {
    boxes_.wide ? boxes_.wide_boxes.resizeDiscarding(slots) : boxes_.boxes.resizeDiscarding(slots);
    const auto packSlot = [this, plain = PlainPacker(rules, boxes_, states_)](
                              const dxGeom* geom, Slot slot, UpdatePart& part) {
      if (plain.pack(geom, slot, part.facts)) return;
      states_[slot] = packer_.pack(geom, slot, part.facts, boxes_);
      count(states_[slot], 1, part.facts);
    };
    const bool is_read = reader && !boxes_.wide;
    int used = 1;
    facts_ = {};
    for (std::size_t first = 0, last = 0; first < slots; first = last) {
      const std::size_t unread = is_read ? (slots - first) / unread_share : 0;
      last = unread < least_unread ? slots : slots - unread;
      used = std::max(used, forGeoms(geoms, last - first, slotsFrom(first), threads, packSlot));
      addParts();
      if (is_read) reader->read(boxes_, first, last);
    }
    moved += facts_.moved;
    facts_.moved = moved;
    // Boxes become doubles once so many coarse ones overlap falsely that exact tests of these would
    // take longer, and floats again when those would be far fewer.
    const bool wide =
        coarse_boxes_.overlapFalsely(geoms, states_, static_cast<std::size_t>(facts_.coarse),
                                     boxes_.size / (boxes_.wide ? 8 : 2));
    if (wide == boxes_.wide || repeated) {
      boxes_.exact = facts_.exact_boxes || boxes_.wide;
      boxes_.filter_bits = facts_.filter_bits;
      boxes_.filter_bodies = facts_.filter_bodies;
      if (!wide) reading.reader = nullptr;
      return used;
    }
    if (is_read) reader->forget();
    boxes_.wide = wide;
    (wide ? boxes_.boxes.release() : boxes_.wide_boxes.release());
  }
}

void GeomUpdate::addParts() {
  for (const UpdatePart& part : parts_) facts_.add(part.facts);
  std::sort(facts_.newly_invalid.begin(), facts_.newly_invalid.end());
}

void GeomUpdate::watchAll() {
  watched_.growTo(states_.size());
  watched_.clear();
  for (std::size_t slot = 0; slot < states_.size(); ++slot)
    if (!(states_[slot] & unwatched_state)) watched_.insert(static_cast<Slot>(slot));
  watching_ = true;
}

int GeomUpdate::addSilent(dxGeom* const* geoms, std::size_t slots, int threads, bool all,
                          SlotSet& changed) {
  if (!watching_) watchAll();
  const std::size_t compared = all ? boxes_.size : watched_.count();
  if (compared == 0) return 1;
  const bool bodies = packer_.rules.skip_asleep, announced = packer_.rules.notified,
             plain = !packer_.rules.leavesOutResting();
  const std::size_t known = std::min(slots, boxes_.size);  // the last ones may be gone
  const auto geomsIn = [&](std::size_t word) {
    std::uint64_t bits = 0;
    const std::size_t first = word * SlotSet::word_slots;
    for (std::size_t i = 0; i < SlotSet::word_slots && first + i < known; ++i)
      bits |= std::uint64_t{geoms[first + i] != nullptr} << i;
    return bits;
  };
  const int members = teamFor(compared, grains::slots, threads);
  return runTeam(comparing, members, [&](int thread, int team) {
    const Range words = ownPart(watched_.words(), thread, team);
    const auto comparedIn = [&](std::size_t word) -> std::uint64_t {
      return (all ? geomsIn(word) : watched_.word(word)) & ~changed.word(word);
    };
    // Of a later slot, where most are compared: geoms at rest without their bits. In some heaps a
    // line ends between the flags and the body.
    const auto prefetchSlot = [&](std::size_t slot) {
      if (slot >= known || !geoms[slot]) return;
      prefetchFar(&geoms[slot]->gflags);
      prefetchFar(&geoms[slot]->body);
      if (plain || announced || boxes_.bodies[slot] != resting_body)
        prefetchFar(&geoms[slot]->category_bits);
    };
    const auto prefetchBody = [&](std::size_t slot) {
      // fixed: where ODE 0.16 has the flags of bodies; their private header is not for us.
      constexpr std::size_t flags = 7 * sizeof(void*);
      if (slot < known && geoms[slot] && geoms[slot]->body)
        prefetchFar(reinterpret_cast<const char*>(geoms[slot]->body) + flags);
    };
    for (std::size_t word = words.begin; word < words.end; ++word) {
      const std::uint64_t here = comparedIn(word);
      const bool most = std::size_t(__builtin_popcountll(here)) >= SlotSet::word_slots / 2;
      for (std::uint64_t bits = here; bits; bits &= bits - 1) {
        const Slot slot = static_cast<Slot>(word * SlotSet::word_slots + __builtin_ctzll(bits));
        const dxGeom* const geom = geoms[slot];
        if (most) prefetchSlot(slot + compare_distance);
        if (plain && isPlainlySame(geom, slot, states_[slot], boxes_)) continue;
        if (bodies && most) prefetchBody(slot + compare_distance / 2);
        if (packer_.changedSilently(geom, slot, states_[slot], boxes_)) changed.insert(slot);
      }
    }
  });
}

GeomUpdate::Unannounced GeomUpdate::findUnannounced(dxGeom* const* geoms,
                                                    const SlotSet& changed) const {
  Unannounced unannounced;
  for (Slot slot = 0; slot < boxes_.size; ++slot)
    if (!changed.contains(slot) && geoms[slot] &&
        packer_.changedSilently(geoms[slot], slot, states_[slot], boxes_) &&
        !packer_.fellAsleep(geoms[slot], slot, boxes_) && unannounced.count++ == 0)
      unannounced.first = slot;
  return unannounced;
}

bool GeomUpdate::repack(dxGeom* const* geoms, std::size_t slots, int threads,
                        const SlotSet& changed) {
  if (!watching_) watchAll();
  const std::size_t before = boxes_.size;
  for (std::size_t slot = slots; slot < before; ++slot) {
    count(states_[slot], -1, facts_);
    watched_.erase(static_cast<Slot>(slot));
  }
  boxes_.resize(slots);
  states_.resize(slots);
  watched_.growTo(slots);
  UpdateFacts unread;
  for (std::size_t slot = before; slot < slots; ++slot)
    states_[slot] = packer_.pack(nullptr, static_cast<Slot>(slot), unread, boxes_);
  changed.listBelow(slots, slots_);
  facts_.moved = 0;
  const auto packSlot = [&](const dxGeom* geom, Slot slot, UpdatePart& part) {
    count(states_[slot], -1, part.facts);
    states_[slot] = packer_.pack(geom, slot, part.facts, boxes_);
    count(states_[slot], 1, part.facts);
  };
  forGeoms(geoms, slots_.size(), slotsOf(slots_), teamFor(slots_.size(), grains::slots, threads),
           packSlot);
  for (const Slot slot : slots_)
    if (states_[slot] & unwatched_state)
      watched_.erase(slot);
    else
      watched_.insert(slot);
  facts_.newly_invalid.clear();
  addParts();
  return canRepack() && boxes_.filter_bits == facts_.filter_bits &&
         boxes_.filter_bodies == facts_.filter_bodies &&
         (boxes_.wide || !coarse_boxes_.areManyMore(static_cast<std::size_t>(facts_.coarse)));
}

}  // namespace ode_parallel_sap
