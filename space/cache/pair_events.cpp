#include "space/cache/pair_events.h"

#include <cstring>
#include <numeric>
#include <utility>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/base/validate.h"
#include "space/geoms/ode_private.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

static Region comparing("pair events: comparison");

void PairEvents::removeGeom(Slot slot) {
  trackSlots();
  if (slot < previous_slots_.size()) previous_slots_[slot] = no_slot;
}

void PairEvents::closeSlots(const Buffer<dxGeom*>& geoms) {
  trackSlots();
  previous_slots_.resize(closeGaps(geoms, previous_slots_));
}

// reserve() has made room.
void PairEvents::trackSlots() {
  if (slots_changed_) return;
  slots_changed_ = true;
  previous_slots_.resizeDiscarding(last_slots_);
  std::iota(previous_slots_.begin(), previous_slots_.end(), Slot{0});
}

bool PairEvents::update(const PairList& pairs, const Buffer<dxGeom*>& geoms, const PairRules& rules,
                        int threads) try {
  freeNumbers();
  const int team = teamFor(pairs.size() + previous_.pairs.size() + resting_.size(),
                           grains::moved_pairs, threads);
  listPreviousGeoms(geoms);
  cutBoth(
      pairs, chunkOf(pairs.size(), chunk_pairs, team), previous_.pairs.begin(),
      previous_.pairs.end(), [this](Pair pair) { return inPreviousSlots(pair); }, spans_);
  changes_.resize(spans_.size());
  next_.pairs.resizeDiscarding(pairs.size());
  next_.numbers.resizeDiscarding(pairs.size());
  if (keeps_touches_) {
    next_.touches.resizeDiscarding(pairs.size());
    previous_.touches.growTo(previous_.pairs.size(), no_touch);
  }
  {
    const ScopedMode mode(exactMode());
    runChunks(comparing, team, spans_.size(), 1,
              [&](const Range& range, int) { compare(range.begin, geoms, rules); });
  }
  callAABBTests(geoms);
  previous_slots_.reserve(geoms.size());  // for trackSlots()
  writeEvents(geoms);
  std::swap(previous_, next_);
  std::swap(resting_, next_resting_);
  last_slots_ = geoms.size();
  slots_changed_ = false;
  has_events_ = true;
  if constexpr (validates) validate();
  return true;
} catch (const std::bad_alloc&) {
  begun_.resizeDiscarding(0);
  ended_.resizeDiscarding(0);
  updateUnknown();
  return false;
}

bool PairEvents::updateSame() {
  if (!has_events_ || slots_changed_) return false;
  if (keeps_touches_ && previous_.touches.size() != previous_.pairs.size()) return false;
  freeNumbers();
  return true;
}

void PairEvents::updateUnknown() {
  freeNumbers();
  has_events_ = false;
}

// The events of the last frame are over, and the numbers of its ended pairs free, except where
// nobody reported that the touch ended. writeEvents() has made room.
void PairEvents::freeNumbers() {
  const auto isBefore = [](const Event& a, const Event& b) { return a.number < b.number; };
  std::sort(ended_touches_.begin(), ended_touches_.end(), isBefore);
  for (const Event& event : ended_)
    if (!std::binary_search(ended_touches_.begin(), ended_touches_.end(), event, isBefore))
      free_.give(event.number);
  for (const Event& touch : ended_touches_) outlived_.push_back(touch);
  begun_.resizeDiscarding(0);
  ended_.resizeDiscarding(0);
  ended_touches_.resizeDiscarding(0);
}

void PairEvents::forgetTouches() {
  keeps_touches_ = false;
  for (Unreported& pair : resting_) pair.touch = no_touch;
  for (const Event& touch : outlived_) free_.give(touch.number);
  outlived_.release();
  ended_touches_.release();
  previous_.touches.release();
  next_.touches.release();
}

Slot PairEvents::previousSlot(Slot slot) const {
  if (!slots_changed_) return slot;
  if (slot < previous_slots_.size() && previous_slots_[slot] != no_slot)
    return previous_slots_[slot];
  return static_cast<Slot>(last_slots_ + slot);
}

Pair PairEvents::inPreviousSlots(Pair pair) const {
  return slots_changed_ ? makePair(previousSlot(earlierOf(pair)), previousSlot(laterOf(pair)))
                        : pair;
}

void PairEvents::listPreviousGeoms(const Buffer<dxGeom*>& geoms) {
  if (!slots_changed_) return;
  previous_geoms_.resizeDiscarding(0);
  previous_geoms_.growTo(last_slots_, nullptr);
  for (Slot slot = 0; slot < geoms.size(); ++slot)
    if (const Slot previous = previousSlot(slot); previous < last_slots_)
      previous_geoms_[previous] = geoms[slot];
}

// Of a pair that is not reported any more.
PairEvents::State PairEvents::stateOf(const dxGeom* a, const dxGeom* b, const PairRules& rules) {
  if (!a || !b || !rules.isLeftOutAtRest(a, b)) return State::ends;
  return hasAABBTest(a) || hasAABBTest(b) ? State::rests_by_aabb_tests : State::rests;
}

bool PairEvents::rests(dxGeom* a, dxGeom* b, const PairRules& rules) {
  State state;
  {
    const ScopedMode mode(exactMode());
    state = stateOf(a, b, rules);
  }
  return state == State::rests || (state != State::ends && passesAABBTests(a, b));
}

// The first pair at rest that belongs to this span or a later one.
const PairEvents::Unreported* PairEvents::restingFrom(std::size_t span) const {
  if (span == 0) return resting_.begin();
  if (span == spans_.size()) return resting_.end();
  return std::lower_bound(resting_.begin(), resting_.end(), inPreviousSlots(*spans_[span].begin),
                          [](const Unreported& resting, Pair pair) { return resting.pair < pair; });
}

// Copies the numbers of pairs that are the same from two places on, eight at a time while it can,
// and returns how many these are.
std::size_t PairEvents::copyLasting(std::size_t place, std::size_t end, std::size_t previous,
                                    std::size_t previous_end) {
  const std::size_t most = std::min(end - place, previous_end - previous);
  const Pair *const next = next_.pairs.data() + place, *const reported =
                                                           previous_.pairs.data() + previous;
  Number* const to = next_.numbers.data() + place;
  const Number* const from = previous_.numbers.data() + previous;
  std::size_t lasting = 0;
  for (constexpr std::size_t eight = 8; lasting + eight <= most; lasting += eight) {
    Pair differ = 0;
    for (std::size_t i = lasting; i < lasting + eight; ++i) differ |= next[i] ^ reported[i];
    if (differ) break;
    std::memcpy(to + lasting, from + lasting, eight * sizeof *to);
  }
  for (; lasting < most && next[lasting] == reported[lasting]; ++lasting)
    to[lasting] = from[lasting];
  if (keeps_touches_)
    std::copy_n(previous_.touches.data() + previous, lasting, next_.touches.data() + place);
  return lasting;
}

// Copies the new pairs, and the numbers of pairs that last.
void PairEvents::compare(std::size_t number, const Buffer<dxGeom*>& geoms, const PairRules& rules) {
  const PairSpan& span = spans_[number];
  const auto stateOf = [&](Pair pair) {
    return PairEvents::stateOf(previousGeom(earlierOf(pair), geoms),
                               previousGeom(laterOf(pair), geoms), rules);
  };
  Changes& changes = changes_[number];
  changes.begun.resizeDiscarding(0);
  changes.unreported.resizeDiscarding(0);
  std::copy(span.begin, span.end, next_.pairs.data() + span.place);
  const std::size_t end = span.place + static_cast<std::size_t>(span.end - span.begin);
  const std::size_t previous_end = span.other_end - previous_.pairs.begin();
  std::size_t place = span.place, previous = span.other - previous_.pairs.begin();
  const Unreported* resting = restingFrom(number);
  const Unreported* const resting_end = restingFrom(number + 1);
  while (place < end || previous < previous_end || resting < resting_end) {
    // Most pairs last, and rarely does any slot change or a pair rest.
    if (!slots_changed_ && resting == resting_end) {
      const std::size_t lasting = copyLasting(place, end, previous, previous_end);
      place += lasting;
      previous += lasting;
    }
    if (place == end && previous == previous_end && resting == resting_end) break;
    const Pair next = place < end ? inPreviousSlots(next_.pairs[place]) : ~Pair{0};
    const Pair reported = previous < previous_end ? previous_.pairs[previous] : ~Pair{0};
    const Pair rested = resting < resting_end ? resting->pair : ~Pair{0};
    if (rested < next && rested < reported) {
      Unreported unreported = *resting;
      unreported.state = stateOf(rested);
      changes.unreported.push_back(unreported);
      ++resting;
    } else if (reported < next) {
      changes.unreported.push_back(
          {reported, previous, previous_.numbers[previous], touchOf(previous), stateOf(reported)});
      ++previous;
    } else if (next == reported) {
      setNext(place, previous_.numbers[previous], touchOf(previous));
      ++place, ++previous;
    } else if (next == rested) {
      setNext(place, resting->number, resting->touch);
      ++place, ++resting;
    } else {
      changes.begun.push_back(place++);
    }
  }
}

// On the calling thread, in the program's floating-point mode.
void PairEvents::callAABBTests(const Buffer<dxGeom*>& geoms) {
  for (Changes& changes : changes_)
    for (Unreported& pair : changes.unreported)
      if (pair.state == State::rests_by_aabb_tests)
        pair.state = passesAABBTests(previousGeom(earlierOf(pair.pair), geoms),
                                     previousGeom(laterOf(pair.pair), geoms))
                         ? State::rests
                         : State::ends;
}

// By how deep the space is in others.
int PairEvents::touchingBit(const Buffer<dxGeom*>& geoms) {
  unsigned depth = 0;
  const auto geom = std::find_if(geoms.begin(), geoms.end(), [](const dxGeom* g) { return g; });
  for (const dxGeom* inner = geom < geoms.end() ? *geom : nullptr; inner; ++depth)
    inner = inner->parent_space;
  return lowest_touching << depth % 4;
}

// Allocates all memory before it takes the first number.
void PairEvents::writeEvents(const Buffer<dxGeom*>& geoms) {
  std::size_t count_begun = 0, count_ended = 0, count_resting = 0, count_touches = 0;
  for (const Changes& changes : changes_) {
    count_begun += changes.begun.size();
    for (const Unreported& pair : changes.unreported) {
      ++(pair.state == State::ends ? count_ended : count_resting);
      count_touches += pair.state == State::ends && pair.touch != no_touch;
    }
  }
  outlived_.reserve(outlived_.size() + count_touches);
  ended_touches_.reserve(count_touches);
  begun_.reserve(count_begun);
  ended_.reserve(count_ended);
  next_resting_.resizeDiscarding(count_resting);
  free_.reserve(count_begun);
  begun_.resizeDiscarding(count_begun);
  ended_.resizeDiscarding(count_ended);
  Event *begun = begun_.data(), *ended = ended_.data();
  Unreported* resting = next_resting_.data();
  const int touching = touchingBit(geoms);
  for (const Changes& changes : changes_) {
    for (const std::size_t place : changes.begun) {
      const Pair pair = next_.pairs[place];
      setNext(place, free_.take(), no_touch);
      *begun++ = {geoms[earlierOf(pair)], geoms[laterOf(pair)], place, next_.numbers[place]};
    }
    for (const Unreported& pair : changes.unreported) {
      // Null where a geom has left.
      dxGeom *const a = previousGeom(earlierOf(pair.pair), geoms), *const b = previousGeom(
                                                                       laterOf(pair.pair), geoms);
      if (pair.state == State::ends) {
        *ended++ = {a, b, pair.place, pair.number};
        if (pair.touch == no_touch) continue;
        ended_touches_.push_back({a, b, pair.touch, pair.number});
        for (dxGeom* const geom : {a, b})
          if (geom) geom->gflags |= touching;
      } else {
        *resting++ = {slots_changed_ ? makePair(Slots::slotOf(a), Slots::slotOf(b)) : pair.pair,
                      pair.place, pair.number, pair.touch, pair.state};
      }
    }
  }
  sortByPlace(ended_);  // those that rested have places of earlier frames
}

void PairEvents::sortByPlace(Buffer<Event>& events) {
  const auto isBefore = [](const Event& a, const Event& b) { return a.place < b.place; };
  if (!std::is_sorted(events.begin(), events.end(), isBefore))
    std::stable_sort(events.begin(), events.end(), isBefore);
}

std::size_t PairEvents::placeOf(Slot a, Slot b) const {
  const Slot p = previousSlot(a), q = previousSlot(b);
  const Pair pair = makePair(std::min(p, q), std::max(p, q));
  const Pair* const begin = previous_.pairs.data();
  const Pair* const end = begin + pairs();
  const Pair* const found = std::lower_bound(begin, end, pair);
  return found < end && *found == pair ? static_cast<std::size_t>(found - begin) : pairs();
}

void PairEvents::release() {
  freeNumbers();
  begun_.release();
  ended_.release();
  next_ = NumberedPairs();
  next_resting_.release();
  previous_geoms_.release();
  changes_ = std::vector<Changes>();
  try {
    previous_.pairs.shrink();
    previous_.numbers.shrink();
    previous_.touches.shrink();
    resting_.shrink();
  } catch (const std::bad_alloc&) {  // they stay as they are
  }
}

}  // namespace ode_parallel_sap
