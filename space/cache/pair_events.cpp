#include "space/cache/pair_events.h"

#include <algorithm>
#include <new>
#include <numeric>
#include <utility>

#include "space/data/parallel.h"
#include "space/data/tuning.h"
#include "space/geom/ode_private.h"
#include "space/geom/slots.h"

namespace ode_parallel_sap {

namespace {

// Pairs that are compared at once.
constexpr std::size_t step = 8;  // fixed: a line of the cache

Region comparing("pair events: comparison"), writing("pair events: pairs and numbers");

bool areSame(const Pair* a, const Pair* b) {
  Pair differing = 0;
  for (std::size_t i = 0; i < step; ++i) differing |= a[i] ^ b[i];
  return differing == 0;
}

}  // namespace

void PairEvents::turn(bool on) {
  if (on == on_) return;
  *this = PairEvents();
  on_ = on;
}

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

bool PairEvents::update(const PairList& pairs, const Buffer<dxGeom*>& geoms, Source source,
                        int threads) try {
  freeNumbers();
  const std::size_t count_pairs = pairs.size();
  const int team = teamFor(count_pairs + previous_.pairs.size(), grains::passed_pairs, threads);
  nameSlots(geoms);
  planPieces(pairs, team);
  runChunks(comparing, team, pieces_.size(), 1,
            [&](const Range& range, int) { count(pieces_[range.begin]); });
  addUp();
  reserve(count_pairs, geoms.size());
  // All memory is there: from here on nothing fails.
  if (begun_.size() || ended_.size() || renamed_) {
    for (Event& event : begun_) event.number = free_.take();
    runChunks(writing, team, pieces_.size(), 1,
              [&](const Range& range, int) { write(pieces_[range.begin], geoms); });
    std::swap(previous_, next_);
  }
  last_slots_ = geoms.size();
  slots_changed_ = false;
  source_ = source;
  has_events_ = true;
  return true;
} catch (const std::bad_alloc&) {
  begun_.resizeDiscarding(0);
  ended_.resizeDiscarding(0);
  updateUnknown();
  return false;
}

bool PairEvents::updateSame(Source source) {
  if (source != source_ || slots_changed_) return false;
  freeNumbers();
  return true;
}

void PairEvents::updateUnknown() {
  freeNumbers();
  has_events_ = false;
  source_ = Source::none;
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
  return renamed_ ? makePair(names_[earlierOf(pair)], names_[laterOf(pair)]) : pair;
}

void PairEvents::nameSlots(const Buffer<dxGeom*>& geoms) {
  renamed_ = false;
  if (!slots_changed_) return;
  for (Slot slot = 0; slot < std::min(geoms.size(), last_slots_); ++slot)
    renamed_ |= geoms[slot] && previousSlot(slot) != slot;
  if (!renamed_) return;
  names_.resizeDiscarding(geoms.size());
  previous_geoms_.resizeDiscarding(0);
  previous_geoms_.growTo(last_slots_, nullptr);
  for (Slot slot = 0; slot < geoms.size(); ++slot) {
    names_[slot] = previousSlot(slot);
    if (names_[slot] < last_slots_) previous_geoms_[names_[slot]] = geoms[slot];
  }
}

void PairEvents::planPieces(const PairList& pairs, int threads) {
  pieces_.clear();
  const Pair* const previous = previous_.pairs.data();
  const Pair* const previous_end = previous + previous_.pairs.size();
  std::size_t place = 0;
  const std::size_t wanted = chunkOf(pairs.size(), chunk_pairs, threads);
  for (const Buffer<Pair>& part : pairs.parts)
    for (const Pair* begin = part.begin(); begin < part.end();) {
      Piece piece = {};
      piece.begin = begin;
      piece.end = begin + std::min<std::size_t>(wanted, part.end() - begin);
      piece.place = place;
      if (place > 0) {
        const Pair* const first = std::lower_bound(previous, previous_end, inPreviousSlots(*begin));
        piece.previous_begin = static_cast<std::size_t>(first - previous);
        pieces_.back().previous_end = piece.previous_begin;
      }
      place += static_cast<std::size_t>(piece.end - begin);
      begin = piece.end;
      pieces_.push_back(piece);
    }
  if (pieces_.empty()) pieces_.push_back({});
  pieces_.back().previous_end = previous_.pairs.size();
}

// Calls begun(new pair), ended(previous place) and same(previous place, number of pairs), in order.
template <class Begun, class Ended, class Same>
void PairEvents::merge(const Piece& piece, Begun begun, Ended ended, Same same) const {
  const Pair* const previous = previous_.pairs.data();
  const Pair* pair = piece.begin;
  std::size_t place = piece.previous_begin;
  while (pair < piece.end && place < piece.previous_end) {
    if (!renamed_ && pair + step <= piece.end && place + step <= piece.previous_end &&
        areSame(pair, previous + place)) {
      same(place, step);
      pair += step;
      place += step;
      continue;
    }
    const Pair now = inPreviousSlots(*pair);
    if (now < previous[place]) {
      begun(*pair++);
    } else if (previous[place] < now) {
      ended(place++);
    } else {
      same(place++, std::size_t{1});
      ++pair;
    }
  }
  while (pair < piece.end) begun(*pair++);
  while (place < piece.previous_end) ended(place++);
}

void PairEvents::count(Piece& piece) const {
  std::size_t begun = 0, ended = 0;
  merge(
      piece, [&](Pair) { ++begun; }, [&](std::size_t) { ++ended; },
      [](std::size_t, std::size_t) {});
  piece.begun = begun;
  piece.ended = ended;
}

void PairEvents::addUp() {
  std::size_t begun = 0, ended = 0;
  for (Piece& piece : pieces_) {
    piece.first_begun = std::exchange(begun, begun + piece.begun);
    piece.first_ended = std::exchange(ended, ended + piece.ended);
  }
  begun_.resizeDiscarding(begun);
  ended_.resizeDiscarding(ended);
}

// For this update, and for trackSlots() until the next one.
void PairEvents::reserve(std::size_t pairs, std::size_t slots) {
  if (begun_.size() || ended_.size() || renamed_) {
    next_.pairs.resizeDiscarding(pairs);
    next_.numbers.resizeDiscarding(pairs);
  }
  free_.reserve(previous_.pairs.size() + begun_.size());
  previous_slots_.reserve(slots);
}

void PairEvents::write(const Piece& piece, const Buffer<dxGeom*>& geoms) {
  std::copy(piece.begin, piece.end, next_.pairs.data() + piece.place);
  const Number* const numbers = previous_.numbers.data();
  Number* number = next_.numbers.data() + piece.place;
  Event* begun = begun_.data() + piece.first_begun;
  Event* ended = ended_.data() + piece.first_ended;
  const auto previousGeom = [&](Slot slot) -> dxGeom* {
    if (renamed_) return previous_geoms_[slot];
    return slot < geoms.size() ? geoms[slot] : nullptr;
  };
  merge(
      piece,
      [&](Pair pair) {
        begun->o1 = geoms[earlierOf(pair)];
        begun->o2 = geoms[laterOf(pair)];
        begun->place = static_cast<std::size_t>(number - next_.numbers.data());
        *number++ = begun++->number;
      },
      [&](std::size_t place) {
        const Pair pair = previous_.pairs[place];
        *ended++ = {previousGeom(earlierOf(pair)), previousGeom(laterOf(pair)), place,
                    numbers[place]};
      },
      [&](std::size_t place, std::size_t count) {
        number = std::copy_n(numbers + place, count, number);
      });
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
  names_.release();
  previous_geoms_.release();
  pieces_ = std::vector<Piece>();
  try {
    previous_.pairs.shrink();
    previous_.numbers.shrink();
  } catch (const std::bad_alloc&) {  // they stay as they are
  }
}

}  // namespace ode_parallel_sap
