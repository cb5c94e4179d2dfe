#include "space/cache/pair_events.h"

#include <algorithm>
#include <new>
#include <numeric>
#include <utility>

#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/geoms/ode_private.h"
#include "space/geoms/slots.h"

namespace ode_parallel_sap {

namespace {

Region comparing("pair events: comparison");

}  // namespace

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

bool PairEvents::update(const PairList& pairs, const Buffer<dxGeom*>& geoms, int threads) try {
  freeNumbers();
  const int team = teamFor(pairs.size() + previous_.pairs.size(), grains::passed_pairs, threads);
  listPreviousGeoms(geoms);
  cutBoth(
      pairs, chunkOf(pairs.size(), chunk_pairs, team), previous_.pairs.begin(),
      previous_.pairs.end(), [this](Pair pair) { return inPreviousSlots(pair); }, spans_);
  places_.resize(spans_.size());
  next_.resize(pairs.size());
  runChunks(comparing, team, spans_.size(), 1,
            [&](const Range& range, int) { compare(spans_[range.begin], places_[range.begin]); });
  previous_slots_.reserve(geoms.size());  // for trackSlots()
  writeEvents(geoms);
  std::swap(previous_, next_);
  last_slots_ = geoms.size();
  slots_changed_ = false;
  has_events_ = true;
  return true;
} catch (const std::bad_alloc&) {
  begun_.resizeDiscarding(0);
  ended_.resizeDiscarding(0);
  updateUnknown();
  return false;
}

bool PairEvents::updateSame() {
  if (!has_events_ || slots_changed_) return false;
  freeNumbers();
  return true;
}

void PairEvents::updateUnknown() {
  freeNumbers();
  has_events_ = false;
}

// The events of the last frame are over, and the numbers of its ended pairs free.
void PairEvents::freeNumbers() {
  for (const Event& event : ended_) free_.give(event.number);
  begun_.resizeDiscarding(0);
  ended_.resizeDiscarding(0);
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

// Copies the new pairs, and the numbers of pairs that are in both frames.
void PairEvents::compare(const PairSpan& span, Places& places) {
  places.begun.resizeDiscarding(0);
  places.ended.resizeDiscarding(0);
  std::copy(span.begin, span.end, next_.pairs.data() + span.place);
  const std::size_t end = span.place + static_cast<std::size_t>(span.end - span.begin);
  const std::size_t previous_end = span.other_end - previous_.pairs.begin();
  std::size_t place = span.place, previous = span.other - previous_.pairs.begin();
  while (place < end || previous < previous_end) {
    const Pair next = place < end ? inPreviousSlots(next_.pairs[place]) : ~Pair{0};
    const Pair before = previous < previous_end ? previous_.pairs[previous] : ~Pair{0};
    if (next == before)
      next_.numbers[place++] = previous_.numbers[previous++];
    else if (next < before)
      places.begun.push_back(place++);
    else
      places.ended.push_back(previous++);
  }
}

// Allocates all memory before it takes the first number.
void PairEvents::writeEvents(const Buffer<dxGeom*>& geoms) {
  std::size_t count_begun = 0, count_ended = 0;
  for (const Places& places : places_) {
    count_begun += places.begun.size();
    count_ended += places.ended.size();
  }
  begun_.resizeDiscarding(count_begun);
  ended_.resizeDiscarding(count_ended);
  free_.reserve(previous_.pairs.size() + count_begun);
  Event *begun = begun_.data(), *ended = ended_.data();
  // Null where a geom has left.
  const Buffer<dxGeom*>& of_previous = slots_changed_ ? previous_geoms_ : geoms;
  for (const Places& places : places_) {
    for (const std::size_t place : places.begun) {
      const Pair pair = next_.pairs[place];
      const Number number = next_.numbers[place] = free_.take();
      *begun++ = {geoms[earlierOf(pair)], geoms[laterOf(pair)], place, number};
    }
    for (const std::size_t place : places.ended) {
      const Pair pair = previous_.pairs[place];
      *ended++ = {of_previous[earlierOf(pair)], of_previous[laterOf(pair)], place,
                  previous_.numbers[place]};
    }
  }
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
  previous_geoms_.release();
  places_ = std::vector<Places>();
  try {
    previous_.pairs.shrink();
    previous_.numbers.shrink();
  } catch (const std::bad_alloc&) {  // they stay as they are
  }
}

}  // namespace ode_parallel_sap
