#include "geom_update.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "floating_point.h"
#include "geom_tests.h"
#include "parallel.h"
#include "round_outward.h"

namespace ode_parallel_sap {

namespace {

// Geoms and bodies lie scattered in memory: their cache lines are asked for in blocks of this many,
// a geom's two blocks and its pose's one block before they are needed.
constexpr std::size_t block_size = 32;

bool hasGimpact() {
  static const bool has = dCheckConfiguration("ODE_EXT_gimpact") != 0;
  return has;
}

// Whether other threads may compute other geoms' AABBs at the same time: not where user code runs,
// where a sub-space cleans its geoms, or where geoms share caches.
bool needsCallingThread(const dxGeom* geom) {
  return IS_SPACE(geom) || isUserClass(geom) || geom->type == dGeomTransformClass ||
         (geom->type == dTriMeshClass && hasGimpact());
}

// Coarse boxes may all overlap each other: boxes become doubles once those pairs could be more than
// the boxes, and floats again when they would be far fewer.
bool needsDoubles(std::size_t coarse, std::size_t slots, const PackRules& rules, bool wide) {
  if (rules.tolerance > 0) return coarse > 0;  // which they would exceed
  return coarse * coarse / 2 > (wide ? slots / 4 : slots);
}

// A slot's share of the facts.
enum : std::uint8_t {
  disabled_state = 1,
  invalid_state = 2,
  unbounded_state = 4,
  coarse_state = 8,
  no_box_state = 16,     // takes part in nothing
  unwatched_state = 32,  // no geom, or one whose silent changes are looked at pair by pair
  space_state = 64,
  user_class_state = 128
};
// What the other stages take from a geom that has a box, without looking at it again.
constexpr std::uint8_t kind_states = unwatched_state | space_state | user_class_state;

std::uint8_t kindOf(const dxGeom* geom, bool resting) {
  return (resting && !geom->body ? unwatched_state : 0) | (IS_SPACE(geom) ? space_state : 0) |
         (isUserClass(geom) ? user_class_state : 0);
}

void count(std::uint8_t state, std::ptrdiff_t sign, UpdateFacts& facts) {
  facts.disabled += state & disabled_state ? sign : 0;
  facts.invalid += state & invalid_state ? sign : 0;
  facts.unbounded += state & unbounded_state ? sign : 0;
  facts.coarse += state & coarse_state ? sign : 0;
}

template <class Real>
constexpr BasicBox<Real> inactiveBox() {
  constexpr Real nan = std::numeric_limits<Real>::quiet_NaN();
  return {{nan, nan, nan}, {nan, nan, nan}};
}

void deactivate(Slot slot, BoxSet& boxes) {
  if (boxes.wide)
    boxes.wide_boxes[slot] = inactiveBox<double>();
  else
    boxes.boxes[slot] = inactiveBox<float>();
}

// All bits as 32: a match of the originals is always a match of these.
std::uint32_t foldBits(unsigned long bits) {
  const std::uint64_t wide = bits;
  return static_cast<std::uint32_t>(wide) | static_cast<std::uint32_t>(wide >> 32);
}
bool foldsExactly(unsigned long bits) {
  const std::uint64_t wide = bits;
  return wide >> 32 == 0 || ~wide == 0;
}

// Bits 4 to 35 of an address tell bodies apart as long as their other bits are alike.
constexpr std::uintptr_t body_bits = std::uintptr_t{0xffffffff} << 4;

std::uint32_t numberOf(const dxBody* body) {
  return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(body) >> 4);
}

// A box's bounds lie this part of the tolerance outside the geom's own. They may stay until they
// are twice as far outside on one of the sides, so that two boxes that meet are never further apart
// than the tolerance.
constexpr dReal margin_share = dReal(1) / 4;

// Bounds moved outward by `margin`, where that is not less than the type's own steps.
void inflate(const dReal* exact, dReal margin, dReal* bounds) {
  for (int i = 0; i < 6; ++i) {
    bounds[i] = exact[i] + (i % 2 ? margin : -margin);
    if (std::fabs(bounds[i] - exact[i]) > margin * dReal(1.25)) bounds[i] = exact[i];
  }
}

// Rounds such bounds to floats. What they let through is within the tolerance, unless the rounding
// adds too much to it.
BoundsFacts roundBounds(const dReal* bounds, dReal margin, Box& box) {
  BoundsFacts facts = roundOutward(bounds, box);
  facts.exact = true;
  facts.coarse = false;
  for (int axis = 0; axis < 3; ++axis) {
    facts.coarse |= bounds[2 * axis] - static_cast<dReal>(box.lower[axis]) > margin / 2;
    facts.coarse |= static_cast<dReal>(box.upper[axis]) - bounds[2 * axis + 1] > margin / 2;
  }
  return facts;
}

// Whether `box` contains the bounds, and no bound is more than `most` outside.
template <class Real>
bool containsClosely(const BasicBox<Real>& box, const dReal* bounds, dReal most) {
  bool contains = true;
  for (int axis = 0; axis < 3; ++axis) {
    const dReal lower = bounds[2 * axis], upper = bounds[2 * axis + 1];
    contains = contains && box.lower[axis] <= lower && box.lower[axis] >= lower - most &&
               box.upper[axis] >= upper && box.upper[axis] <= upper + most;
  }
  return contains;
}

void prefetch(const void* object, std::size_t size) {
  const char* const bytes = static_cast<const char*>(object);
  for (std::size_t line = 0; line < size; line += 64) __builtin_prefetch(bytes + line);
  __builtin_prefetch(bytes + size - 1);
}

// What notice() reads of a geom, and of the body of one that was at rest.
void prefetchStatus(const dxGeom* geom, bool resting) {
  __builtin_prefetch(&geom->gflags);
  __builtin_prefetch(&geom->body);
  if (resting) return;
  __builtin_prefetch(&geom->category_bits);
  __builtin_prefetch(&geom->collide_bits);
}
void prefetchStatus(const dxBody* body) {
  constexpr std::size_t flags = 56;  // in ODE 0.16; elsewhere a prefetch in vain
  __builtin_prefetch(reinterpret_cast<const char*>(body) + flags);
}

}  // namespace

void UpdateFacts::add(const UpdateFacts& other) {
  moved += other.moved;
  disabled += other.disabled;
  invalid += other.invalid;
  unbounded += other.unbounded;
  coarse += other.coarse;
  user_classes = user_classes || other.user_classes;
  spaces = spaces || other.spaces;
  exact_bits = exact_bits && other.exact_bits;
  exact_bodies = exact_bodies && other.exact_bodies;
  exact_boxes = exact_boxes && other.exact_boxes;
  filter_bits = filter_bits || other.filter_bits;
  filter_bodies = filter_bodies || other.filter_bodies;
  newly_invalid.insert(newly_invalid.end(), other.newly_invalid.begin(), other.newly_invalid.end());
}

// Brings the geoms of slots slotOf(0) to slotOf(count - 1) up to date, and calls use(geom, slot,
// part) for each; geom may be null.
template <class SlotOf, class Use>
int GeomUpdate::forGeoms(dxGeom* const* geoms, std::size_t count, int threads, SlotOf slotOf,
                         Use use) {
  const int parts = threads;
  if (parts_.size() < static_cast<std::size_t>(parts) + 1) parts_.resize(parts + 1);
  part_count_ = parts;
  for (int index = 0; index <= parts; ++index) {
    Part& part = parts_[index];
    part.facts = UpdateFacts();
    part.deferred.clear();
    part.staying.clear();
    part.some_body = 0;
  }
  const auto prefetchGeoms = [&](const Range& range) {
    // The derived classes' sizes follow the base: one line more holds most of them.
    for (std::size_t i = range.begin; i < range.end; ++i)
      if (const dxGeom* const geom = geoms[slotOf(i)]) prefetch(geom, sizeof(dxGeom) + 32);
  };
  const auto prefetchPoses = [&](const Range& range) {
    for (std::size_t i = range.begin; i < range.end; ++i)
      if (const dxGeom* const geom = geoms[slotOf(i)])
        if (geom->final_posr) prefetch(geom->final_posr, sizeof(dxPosR));
  };
  int used = 1;
  runTeam(parts, [&](int thread, int team) {
    if (thread == 0) used = team;
    for (int index = thread; index < parts; index += team) {
      Part& part = parts_[index];
      const Range range = partOf(count, index, parts);
      const auto block = [&](std::size_t begin) {
        return Range{std::min(begin, range.end), std::min(begin + block_size, range.end)};
      };
      prefetchGeoms(block(range.begin));
      prefetchPoses(block(range.begin));
      prefetchGeoms(block(range.begin + block_size));
      for (std::size_t begin = range.begin; begin < range.end; begin += block_size) {
        const std::size_t end = block(begin).end;
        prefetchGeoms(block(begin + 2 * block_size));
        prefetchPoses(block(begin + block_size));
        for (std::size_t i = begin; i < end; ++i) {
          const Slot slot = slotOf(i);
          dxGeom* const geom = geoms[slot];
          if (!geom || !(geom->gflags & GEOM_DIRTY)) continue;
          ++part.facts.moved;
          if (needsCallingThread(geom))
            part.deferred.push_back(slot);
          else
            cleanGeom(geom);
        }
        const ScopedMode exact(exactMode());
        for (std::size_t i = begin; i < end; ++i) {
          const Slot slot = slotOf(i);
          const dxGeom* const geom = geoms[slot];
          if (!geom || !(geom->gflags & GEOM_DIRTY)) use(geom, slot, part);
        }
      }
    }
  });
  Part& serial = parts_[parts];
  for (int index = 0; index < parts; ++index)
    for (const Slot slot : parts_[index].deferred) {
      cleanGeom(geoms[slot]);
      const ScopedMode exact(exactMode());
      use(geoms[slot], slot, serial);
    }
  return used;
}

void GeomUpdate::clean(dxGeom* const* geoms, std::size_t slots, int threads,
                       const SlotSet* changed) {
  const auto ignore = [](const dxGeom*, Slot, Part&) {};
  if (!changed) {
    forGeoms(
        geoms, slots, threads, [](std::size_t i) { return static_cast<Slot>(i); }, ignore);
    return;
  }
  listSlots(*changed, slots);
  forGeoms(
      geoms, slots_.size(), threads, [&](std::size_t i) { return slots_[i]; }, ignore);
}

void GeomUpdate::listSlots(const SlotSet& set, std::size_t slots) {
  slots_.resizeDiscarding(0);
  set.forEach([&](Slot slot) {
    if (slot < slots) slots_.push_back(slot);
  });
}

// Geoms at rest are packed as if enabled and with all bits set, because their silent changes are
// not noticed here: pairs with them are looked at again in every frame.
GeomUpdate::State GeomUpdate::packGeom(const dxGeom* geom, Slot slot, Part& part,
                                       BoxSet& boxes) const {
  if (!geom) {
    deactivate(slot, boxes);
    return no_box_state | unwatched_state;
  }
  UpdateFacts& facts = part.facts;
  const bool resting = isResting(geom, rules_);
  boxes.bodies[slot] = resting ? resting_number : numberOf(geom->body);
  State state = kindOf(geom, resting);
  if (!isEnabled(geom)) {
    state |= disabled_state;
    if (!resting || geom->gflags & GEOM_ZERO_SIZED) {
      deactivate(slot, boxes);
      return state | no_box_state;
    }
  }
  const dReal margin = rules_.tolerance * margin_share;
  const dReal* bounds = geom->aabb;
  dReal inflated[6];
  Box box;
  BoundsFacts rounded;
  if (__builtin_expect(margin > 0, false)) {
    inflate(bounds, margin, inflated);
    bounds = inflated;
    rounded = roundBounds(bounds, margin, box);
  } else {
    rounded = roundOutward(bounds, box);
  }
  if (rounded.nan) {
    facts.newly_invalid.push_back(slot);
    deactivate(slot, boxes);
    return state | no_box_state | invalid_state;
  }
  if (boxes.wide) {
    BasicBox<double>& wide = boxes.wide_boxes[slot];
    for (int axis = 0; axis < 3; ++axis) {
      wide.lower[axis] = bounds[2 * axis];
      wide.upper[axis] = bounds[2 * axis + 1];
    }
  } else {
    boxes.boxes[slot] = box;
  }
  facts.exact_boxes = facts.exact_boxes && rounded.exact;
  facts.user_classes = facts.user_classes || state & user_class_state;
  facts.spaces = facts.spaces || state & space_state;
  state |= (rounded.unbounded ? unbounded_state : 0) | (rounded.coarse ? coarse_state : 0);
  if (resting) {
    boxes.bits[slot] = {~std::uint32_t{0}, ~std::uint32_t{0}};
    facts.filter_bodies = true;
    return state;
  }

  facts.filter_bits = facts.filter_bits || ~geom->category_bits || ~geom->collide_bits;
  facts.exact_bits =
      facts.exact_bits && foldsExactly(geom->category_bits) && foldsExactly(geom->collide_bits);
  boxes.bits[slot] = {foldBits(geom->category_bits), foldBits(geom->collide_bits)};
  // Of two geoms on one body at least one is followed by another in the body's list.
  if (const std::uintptr_t body = reinterpret_cast<std::uintptr_t>(geom->body)) {
    facts.filter_bodies = facts.filter_bodies || geom->body_next;
    if (!part.some_body) part.some_body = body;
    if ((body ^ part.some_body) & ~body_bits) facts.exact_bodies = false;
    const std::uint32_t number = boxes.bodies[slot];
    if (number == 0 || number == resting_number) facts.exact_bodies = false;
  }
  return state;
}

int GeomUpdate::pack(dxGeom* const* geoms, std::size_t slots, const PackRules& rules, int threads,
                     BoxSet& boxes) {
  rules_ = rules;
  watching_ = false;
  boxes.size = slots;
  boxes.bits.resizeDiscarding(slots);
  boxes.bodies.resizeDiscarding(slots);
  states_.resizeDiscarding(slots);
  std::size_t moved = 0;
  for (;;) {
    if (boxes.wide)
      boxes.wide_boxes.resizeDiscarding(slots);
    else
      boxes.boxes.resizeDiscarding(slots);
    const int used = forGeoms(
        geoms, slots, threads, [](std::size_t i) { return static_cast<Slot>(i); },
        [&](const dxGeom* geom, Slot slot, Part& part) {
          const State state = packGeom(geom, slot, part, boxes);
          states_[slot] = state;
          if (state) count(state, 1, part.facts);
        });
    some_body_ = 0;
    facts_ = mergeParts(0);
    moved += facts_.moved;
    facts_.moved = moved;
    const bool wide = needsDoubles(facts_.coarse, slots, rules_, boxes.wide);
    if (wide == boxes.wide) return used;
    boxes.wide = wide;
    (wide ? boxes.boxes.release() : boxes.wide_boxes.release());
  }
}

// The parts' facts made one, for bodies whose addresses are to be compared with `some_body` too.
UpdateFacts GeomUpdate::mergeParts(std::uintptr_t some_body) {
  UpdateFacts facts;
  for (int index = 0; index <= part_count_; ++index) {
    const Part& part = parts_[index];
    facts.add(part.facts);
    if (!part.some_body) continue;
    if (!some_body) some_body = part.some_body;
    if ((part.some_body ^ some_body) & ~body_bits) facts.exact_bodies = false;
  }
  some_body_ = some_body;
  std::sort(facts.newly_invalid.begin(), facts.newly_invalid.end());
  return facts;
}

// Where addresses are too far apart for 32 of their bits to tell them apart.
void GeomUpdate::numberBodies(dxGeom* const* geoms, BoxSet& boxes) {
  body_numbers_.clear();
  for (std::size_t slot = 0; slot < boxes.size; ++slot) {
    const dxBody* const body = geoms[slot] ? geoms[slot]->body : nullptr;
    if (boxes.bodies[slot] == resting_number && geoms[slot] && isResting(geoms[slot], rules_))
      continue;
    boxes.bodies[slot] =
        body ? body_numbers_.emplace(body, static_cast<std::uint32_t>(body_numbers_.size() + 1))
                   .first->second
             : 0;
  }
}

const UpdateFacts& GeomUpdate::synchronise(dxGeom* const* geoms, BoxSet& boxes) {
  if (facts_.filter_bodies && !facts_.exact_bodies) numberBodies(geoms, boxes);
  facts_.exact_boxes = facts_.exact_boxes || boxes.wide || std::is_same<dReal, float>::value;
  boxes.exact = facts_.exact_boxes;
  boxes.filter_bits = facts_.filter_bits;
  boxes.filter_bodies = facts_.filter_bodies;
  return facts_;
}

bool GeomUpdate::changedUnnoticed(const dxGeom* geom, Slot slot, const BoxSet& boxes) const {
  const bool resting = isResting(geom, rules_);
  if (resting != (boxes.bodies[slot] == resting_number)) return true;
  if (resting) return false;
  const State state = states_[slot];
  const bool enabled = isEnabled(geom);
  if (enabled != !(state & disabled_state)) return true;
  if (state & no_box_state) return false;
  return boxes.bits[slot].category != foldBits(geom->category_bits) ||
         boxes.bits[slot].collide != foldBits(geom->collide_bits) ||
         !foldsExactly(geom->category_bits) || !foldsExactly(geom->collide_bits) ||
         boxes.bodies[slot] != numberOf(geom->body);
}

void GeomUpdate::watchAll() {
  watched_.growTo(states_.size());
  watched_.clear();
  for (std::size_t slot = 0; slot < states_.size(); ++slot)
    if (!(states_[slot] & unwatched_state)) watched_.insert(static_cast<Slot>(slot));
  watching_ = true;
}

int GeomUpdate::notice(dxGeom* const* geoms, int threads, const BoxSet& boxes, SlotSet& changed) {
  if (!watching_) watchAll();
  int used = 1;
  runTeam(threads, [&](int thread, int team) {
    if (thread == 0) used = team;
    const Range words = partOf(watched_.words(), thread, team);
    const auto watchedIn = [&](std::size_t word) {
      return word < words.end ? watched_.word(word) & ~changed.word(word) : 0;
    };
    const auto prefetchIn = [&](std::size_t word, bool bodies) {
      for (std::uint64_t bits = watchedIn(word); bits; bits &= bits - 1) {
        const std::size_t slot = word * SlotSet::word_slots + __builtin_ctzll(bits);
        if (!bodies)
          prefetchStatus(geoms[slot], boxes.bodies[slot] == resting_number);
        else if (geoms[slot]->body)
          prefetchStatus(geoms[slot]->body);
      }
    };
    prefetchIn(words.begin, false);
    for (std::size_t word = words.begin; word < words.end; ++word) {
      prefetchIn(word + 1, false);
      if (rules_.skip_asleep) prefetchIn(word, true);
      for (std::uint64_t bits = watchedIn(word); bits; bits &= bits - 1) {
        const Slot slot = static_cast<Slot>(word * SlotSet::word_slots + __builtin_ctzll(bits));
        if (changedUnnoticed(geoms[slot], slot, boxes)) changed.insert(slot);
      }
    }
  });
  return used;
}

// Room for all slots, with the boxes of before. What is beyond them counts no more.
void GeomUpdate::resizeTo(std::size_t slots, BoxSet& boxes) {
  const std::size_t before = boxes.size;
  for (std::size_t slot = slots; slot < before; ++slot) {
    count(states_[slot], -1, facts_);
    watched_.erase(static_cast<Slot>(slot));
  }
  boxes.size = slots;
  if (boxes.wide)
    boxes.wide_boxes.resize(slots);
  else
    boxes.boxes.resize(slots);
  boxes.bits.resize(slots);
  boxes.bodies.resize(slots);
  states_.resize(slots);
  watched_.growTo(slots);
  for (std::size_t slot = before; slot < slots; ++slot)
    states_[slot] = no_box_state | unwatched_state;
}

bool GeomUpdate::mayStay(const dxGeom* geom, Slot slot, const BoxSet& boxes) const {
  if (!geom || states_[slot] & no_box_state || changedUnnoticed(geom, slot, boxes)) return false;
  // The slot may have another geom now.
  if ((states_[slot] & kind_states) != kindOf(geom, isResting(geom, rules_))) return false;
  const dReal most = 2 * margin_share * rules_.tolerance;
  return boxes.wide ? containsClosely(boxes.wide_boxes[slot], geom->aabb, most)
                    : containsClosely(boxes.boxes[slot], geom->aabb, most);
}

bool GeomUpdate::repack(dxGeom* const* geoms, std::size_t slots, int threads, SlotSet& changed,
                        BoxSet& boxes) {
  if (!watching_) watchAll();
  resizeTo(slots, boxes);
  listSlots(changed, slots);
  constexpr std::size_t least_slots_a_thread = 1024;
  threads =
      static_cast<int>(std::min<std::size_t>(threads, slots_.size() / least_slots_a_thread + 1));
  forGeoms(
      geoms, slots_.size(), threads, [&](std::size_t i) { return slots_[i]; },
      [&](const dxGeom* geom, Slot slot, Part& part) {
        if (rules_.tolerance > 0 && mayStay(geom, slot, boxes)) {
          part.staying.push_back(slot);
          return;
        }
        const State state = packGeom(geom, slot, part, boxes);
        count(states_[slot], -1, part.facts);
        count(state, 1, part.facts);
        states_[slot] = state;
      });
  for (const Slot slot : slots_)
    if (states_[slot] & unwatched_state)
      watched_.erase(slot);
    else
      watched_.insert(slot);
  bool some_stay = false;
  for (int index = 0; index <= part_count_; ++index)
    for (const Slot slot : parts_[index].staying) {
      changed.erase(slot);
      some_stay = true;
    }
  if (some_stay)
    slots_.resize(std::remove_if(slots_.begin(), slots_.end(),
                                 [&](Slot slot) { return !changed.contains(slot); }) -
                  slots_.begin());

  UpdateFacts delta = mergeParts(some_body_);
  facts_.moved = delta.moved;
  facts_.disabled += delta.disabled;
  facts_.invalid += delta.invalid;
  facts_.unbounded += delta.unbounded;
  facts_.coarse += delta.coarse;
  facts_.user_classes = facts_.user_classes || delta.user_classes;
  facts_.spaces = facts_.spaces || delta.spaces;
  facts_.newly_invalid.swap(delta.newly_invalid);
  facts_.exact_boxes =
      facts_.exact_boxes && (delta.exact_boxes || boxes.wide || std::is_same<dReal, float>::value);
  boxes.exact = facts_.exact_boxes;
  return delta.exact_bits && delta.exact_bodies && (boxes.filter_bits || !delta.filter_bits) &&
         (boxes.filter_bodies || !delta.filter_bodies) &&
         needsDoubles(facts_.coarse, slots, rules_, boxes.wide) == boxes.wide;
}

std::size_t GeomUpdate::bytes() const {
  return states_.bytes() + watched_.bytes() + slots_.bytes();
}

}  // namespace ode_parallel_sap
