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
  planPieces(pairs, team);
  next_.resize(pairs.size());
  runChunks(comparing, team, pieces_.size(), 1,
            [&](const Range& range, int) { compare(pieces_[range.begin]); });
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

void PairEvents::planPieces(const PairList& pairs, int threads) {
  const Buffer<Pair>& previous = previous_.pairs;
  const std::size_t wanted = chunkOf(pairs.size(), chunk_pairs, threads);
  std::size_t count = 0, place = 0;
  const auto add = [&](const Pair* begin, const Pair* end) {
    if (pieces_.size() == count) pieces_.emplace_back();
    Piece& piece = pieces_[count];
    piece.begin = begin;
    piece.end = end;
    piece.place = place;
    piece.previous_place = 0;
    if (count > 0)
      pieces_[count - 1].previous_end = piece.previous_place = static_cast<std::size_t>(
          std::lower_bound(previous.begin(), previous.end(), inPreviousSlots(*begin)) -
          previous.begin());
    ++count;
    place += static_cast<std::size_t>(end - begin);
  };
  for (const Buffer<Pair>& part : pairs.parts)
    for (std::size_t i = 0; i < part.size(); i += wanted)
      add(part.data() + i, part.data() + std::min(i + wanted, part.size()));
  if (count == 0) add(nullptr, nullptr);
  pieces_.resize(count);
  pieces_.back().previous_end = previous.size();
}

// Copies the new pairs, and the numbers of pairs that are in both frames.
void PairEvents::compare(Piece& piece) {
  piece.begun.resizeDiscarding(0);
  piece.ended.resizeDiscarding(0);
  std::copy(piece.begin, piece.end, next_.pairs.data() + piece.place);
  std::size_t place = piece.place, previous = piece.previous_place;
  const std::size_t end = place + static_cast<std::size_t>(piece.end - piece.begin);
  while (place < end || previous < piece.previous_end) {
    const Pair next = place < end ? inPreviousSlots(next_.pairs[place]) : ~Pair{0};
    const Pair before = previous < piece.previous_end ? previous_.pairs[previous] : ~Pair{0};
    if (next == before)
      next_.numbers[place++] = previous_.numbers[previous++];
    else if (next < before)
      piece.begun.push_back(place++);
    else
      piece.ended.push_back(previous++);
  }
}

// Allocates all memory before it takes the first number.
void PairEvents::writeEvents(const Buffer<dxGeom*>& geoms) {
  std::size_t count_begun = 0, count_ended = 0;
  for (const Piece& piece : pieces_) {
    count_begun += piece.begun.size();
    count_ended += piece.ended.size();
  }
  begun_.resizeDiscarding(count_begun);
  ended_.resizeDiscarding(count_ended);
  free_.reserve(previous_.pairs.size() + count_begun);
  Event *begun = begun_.data(), *ended = ended_.data();
  // Null where a geom has left.
  const Buffer<dxGeom*>& of_previous = slots_changed_ ? previous_geoms_ : geoms;
  for (const Piece& piece : pieces_) {
    for (const std::size_t place : piece.begun) {
      const Pair pair = next_.pairs[place];
      const Number number = next_.numbers[place] = free_.take();
      *begun++ = {geoms[earlierOf(pair)], geoms[laterOf(pair)], place, number};
    }
    for (const std::size_t place : piece.ended) {
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
  pieces_ = std::vector<Piece>();
  try {
    previous_.pairs.shrink();
    previous_.numbers.shrink();
  } catch (const std::bad_alloc&) {  // they stay as they are
  }
}

}  // namespace ode_parallel_sap
