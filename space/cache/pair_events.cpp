#include "space/coherence/pair_events.h"

#include <algorithm>
#include <new>
#include <numeric>
#include <utility>

#include "space/data/mechanisms.h"
#include "space/data/parallel.h"
#include "space/data/tuning.h"
#include "space/geom/ode_private.h"
#include "space/geom/slots.h"

namespace ode_parallel_sap {

namespace {

// Pairs that are compared at once.
constexpr std::ptrdiff_t step = 8;  // fixed: a line of the cache

Region comparing("pair events: comparison"), writing("pair events: pairs and numbers");

bool areSame(const Pair* a, const Pair* b) {
  Pair differing = 0;
  for (std::ptrdiff_t i = 0; i < step; ++i) differing |= a[i] ^ b[i];
  return differing == 0;
}

}  // namespace

// New pairs against old ones.
class PairEvents::Comparison {
 public:
  // `old_slots`: by new slot; null where they are the same.
  Comparison(const ToldPairs& old, const Slot* old_slots) : old_(old), old_slots_(old_slots) {}

  std::size_t oldPairs() const { return old_.size(); }
  Pair inOldSlots(Pair pair) const {
    return old_slots_ ? makePair(old_slots_[earlierOf(pair)], old_slots_[laterOf(pair)]) : pair;
  }
  // Of the old pairs those that come before this new one.
  std::size_t oldBefore(Pair pair) const { return old_.before(inOldSlots(pair)); }
  void run(const Piece& piece, PairChanges& findings) const {
    const Pair* pair = piece.begin;
    old_.forRuns(piece.old_begin, piece.old_end,
                 [&](const Pair* begin, const Pair* end, std::size_t place) {
                   pair = pass(piece, pair, {begin, end, place}, findings);
                 });
    while (pair < piece.end) findings.begun.push_back(indexIn(piece, pair++));
  }

 private:
  // Old pairs that lie together.
  struct OldRun {
    const Pair *begin, *end;
    std::size_t place;  // of the first
    std::size_t placeOf(const Pair* old) const {
      return place + static_cast<std::size_t>(old - begin);
    }
  };

  static std::size_t indexIn(const Piece& piece, const Pair* pair) {
    return static_cast<std::size_t>(pair - piece.begin);
  }

  // The piece's pairs from `pair` on against a run. Returns the first that comes after the run.
  const Pair* pass(const Piece& piece, const Pair* pair, const OldRun& run,
                   PairChanges& findings) const {
    const Pair* old = run.begin;
    while (pair < piece.end && old < run.end) {
      if (!old_slots_ && piece.end - pair >= step && run.end - old >= step && areSame(pair, old)) {
        pair += step;
        old += step;
        continue;
      }
      const Pair now = inOldSlots(*pair);
      if (now < *old) {
        findings.begun.push_back(indexIn(piece, pair++));
      } else if (*old < now) {
        findings.ended.push_back(run.placeOf(old++));
      } else {
        ++pair;
        ++old;
      }
    }
    while (old < run.end) findings.ended.push_back(run.placeOf(old++));
    return pair;
  }

  const ToldPairs& old_;
  const Slot* const old_slots_;
};

void PairEvents::turn(bool on) {
  if (on == on_) return;
  *this = PairEvents();
  on_ = on;
}

void PairEvents::forget(Slot slot) {
  const std::size_t known = closed_ ? was_.size() : last_slots_;
  if (slot >= known) return;
  gone_.insert(closed_ ? was_[slot] : slot);
  any_gone_ = true;
}

// All that stay have lower slots than any that came since, but for those that sit in slots of geoms
// that are gone, and are marked so. There is room: see reserve().
void PairEvents::closeSlots(const Buffer<dxGeom*>& geoms) {
  if (!closed_) {
    was_.resizeDiscarding(last_slots_);
    std::iota(was_.begin(), was_.end(), Slot{0});
  }
  was_.resize(closeGaps(geoms, was_));
  closed_ = true;
}

// A slot's name among the old ones; above all of these if its geom came later.
Slot PairEvents::oldOf(Slot slot) const {
  const std::size_t known = closed_ ? was_.size() : last_slots_;
  if (slot < known) {
    const Slot old = closed_ ? was_[slot] : slot;
    if (!gone_.contains(old)) return old;
  }
  return static_cast<Slot>(last_slots_ + slot);
}

// Null if it has left.
dxGeom* PairEvents::geomOf(Slot old, const Buffer<dxGeom*>& geoms) const {
  if (gone_.contains(old)) return nullptr;
  if (!closed_) return geoms[old];
  return geoms[std::lower_bound(was_.begin(), was_.end(), old) - was_.begin()];
}

// Null where slots are what they were, but for those of new geoms above them.
const Slot* PairEvents::nameOldSlots(const Buffer<dxGeom*>& geoms) {
  bool renamed = closed_;
  if (any_gone_ && !closed_)
    gone_.forEach([&](Slot slot) { renamed |= slot < geoms.size() && geoms[slot]; });
  if (!renamed) return nullptr;
  old_slots_.resizeDiscarding(geoms.size());
  for (Slot slot = 0; slot < geoms.size(); ++slot) old_slots_[slot] = oldOf(slot);
  return old_slots_.data();
}

// What was told of the last frame is no more, and the numbers of what ended in it are free.
void PairEvents::retire() {
  for (const Event& event : ended_) free_.give(event.number);
  begun_.resizeDiscarding(0);
  ended_.resizeDiscarding(0);
}

void PairEvents::tellNothing() {
  retire();
  is_known_ = false;
  source_ = Source::none;
}

bool PairEvents::tellSame(Source source) {
  if (source != source_ || any_gone_ || closed_) return false;
  retire();
  return true;
}

bool PairEvents::tellChanged(const PairList& pairs, const std::vector<ChangedPiece>& changes,
                             const Buffer<dxGeom*>& geoms, Source source, int threads) {
  if (!mechanisms::events_of_changes || source != source_ || any_gone_ || closed_) return false;
  return tellFound(pairs, geoms, source, threads, [&](int) { takePieces(pairs, changes); });
}

bool PairEvents::tell(const PairList& pairs, const Buffer<dxGeom*>& geoms, Source source,
                      int threads) {
  return tellFound(pairs, geoms, source, threads, [&](int team) {
    const Comparison comparison(told_, nameOldSlots(geoms));
    planPieces(pairs, comparison, team);
    findChanges(comparison, team);
  });
}

// find(team) leaves what begins and ends in pieces_. Nothing that lasts is changed before all
// memory is there.
template <class Find>
bool PairEvents::tellFound(const PairList& pairs, const Buffer<dxGeom*>& geoms, Source source,
                           int threads, Find find) {
  retire();
  try {
    const int team = teamFor(pairs.size() + told_.size(), grains::passed_pairs, threads);
    find(team);
    addUp();
    reserve(pairs, geoms.size());
    for (Event& event : begun_) event.number = free_.take();
    if (begun_.size() || ended_.size() || closed_) {
      write(geoms, team);
      numbers_.swap(next_numbers_);
    }
  } catch (const std::bad_alloc&) {
    begun_.resizeDiscarding(0);
    ended_.resizeDiscarding(0);
    tellNothing();
    return false;
  }
  told_.see(pairs);
  last_slots_ = geoms.size();
  if (any_gone_) gone_.clear();
  any_gone_ = closed_ = false;
  source_ = source;
  is_known_ = true;
  return true;
}

// By parts of the new pairs.
void PairEvents::takePieces(const PairList& pairs, const std::vector<ChangedPiece>& changes) {
  pieces_.clear();
  std::size_t place = 0;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const ChangedPiece& of = changes[i];
    const Buffer<Pair>& part = pairs.parts[i];
    pieces_.push_back({part.begin(), part.end(), place, of.old_begin, of.old_end, of.changes, 0,
                       of.changes->begun.size(), 0, of.changes->ended.size(), 0, 0});
    place += part.size();
  }
}

void PairEvents::planPieces(const PairList& pairs, const Comparison& comparison, int threads) {
  pieces_.clear();
  std::size_t place = 0;
  const std::size_t wanted = chunkOf(pairs.size(), chunk_pairs, threads);
  for (const Buffer<Pair>& part : pairs.parts)
    for (const Pair* begin = part.begin(); begin < part.end();) {
      const Pair* const end = begin + std::min<std::size_t>(wanted, part.end() - begin);
      Piece piece = {};
      piece.begin = begin;
      piece.end = end;
      piece.place = place;
      piece.old_begin = place == 0 ? 0 : comparison.oldBefore(*begin);
      if (place > 0) pieces_.back().old_end = piece.old_begin;
      pieces_.push_back(piece);
      place += static_cast<std::size_t>(end - begin);
      begin = end;
    }
  if (pieces_.empty()) pieces_.push_back({});
  pieces_.back().old_end = comparison.oldPairs();
}

void PairEvents::findChanges(const Comparison& comparison, int threads) {
  if (findings_.size() < static_cast<std::size_t>(threads)) findings_.resize(threads);
  for (PairChanges& findings : findings_) findings.clear();
  runChunks(comparing, threads, pieces_.size(), 1, [&](const Range& range, int thread) {
    PairChanges& findings = findings_[thread];
    Piece& piece = pieces_[range.begin];
    piece.changes = &findings;
    piece.first_begun = findings.begun.size();
    piece.first_ended = findings.ended.size();
    comparison.run(piece, findings);
    piece.begun = findings.begun.size() - piece.first_begun;
    piece.ended = findings.ended.size() - piece.first_ended;
  });
}

void PairEvents::addUp() {
  std::size_t begun = 0, ended = 0;
  for (Piece& piece : pieces_) {
    piece.begun_before = std::exchange(begun, begun + piece.begun);
    piece.ended_before = std::exchange(ended, ended + piece.ended);
  }
  begun_.resizeDiscarding(begun);
  ended_.resizeDiscarding(ended);
}

// For what is to be written now, and for what may happen to so many slots until the next frame.
void PairEvents::reserve(const PairList& pairs, std::size_t slots) {
  if (begun_.size() || ended_.size() || closed_) next_numbers_.resizeDiscarding(pairs.size());
  told_.reserve(pairs.parts.size());
  free_.reserve(told_.size() + begun_.size());
  gone_.growTo(slots);
  was_.reserve(slots);
}

void PairEvents::write(const Buffer<dxGeom*>& geoms, int threads) {
  runChunks(writing, threads, pieces_.size(), 1, [&](const Range& range, int) {
    const Piece& piece = pieces_[range.begin];
    writeEvents(piece, geoms);
    writeNumbers(piece);
  });
}

void PairEvents::writeEvents(const Piece& piece, const Buffer<dxGeom*>& geoms) {
  const PairChanges& changes = *piece.changes;
  for (std::size_t i = 0; i < piece.begun; ++i) {
    Event& event = begun_[piece.begun_before + i];
    const std::size_t place = changes.begun[piece.first_begun + i];
    const Pair pair = piece.begin[place];
    event.place = piece.place + place;
    event.o1 = geoms[earlierOf(pair)];
    event.o2 = geoms[laterOf(pair)];
  }
  for (std::size_t i = 0; i < piece.ended; ++i) {
    Event& event = ended_[piece.ended_before + i];
    event.place = changes.ended[piece.first_ended + i];
    const Pair pair = told_.at(event.place);
    event.o1 = geomOf(earlierOf(pair), geoms);
    event.o2 = geomOf(laterOf(pair), geoms);
    event.number = numbers_[event.place];
  }
}

// Between two events pairs last, and their numbers move together.
void PairEvents::writeNumbers(const Piece& piece) {
  const Event* begun = begun_.data() + piece.begun_before;
  const Event* const last_begun = begun + piece.begun;
  const Event* ended = ended_.data() + piece.ended_before;
  const Event* const last_ended = ended + piece.ended;
  std::size_t place = piece.place, old = piece.old_begin;
  const std::size_t end = place + static_cast<std::size_t>(piece.end - piece.begin);
  while (place < end) {
    const std::size_t next_begun = begun < last_begun ? begun->place : end;
    const std::size_t next_ended = ended < last_ended ? ended->place : piece.old_end;
    const std::size_t last = std::min(next_begun - place, next_ended - old);
    std::copy(numbers_.data() + old, numbers_.data() + old + last, next_numbers_.data() + place);
    place += last;
    old += last;
    if (begun < last_begun && place == begun->place)
      next_numbers_[place++] = begun++->number;
    else if (ended < last_ended && old == ended->place)
      ++old, ++ended;
  }
}

std::size_t PairEvents::placeOf(Slot a, Slot b) const {
  const Slot p = oldOf(a), q = oldOf(b);
  const Pair pair = makePair(std::min(p, q), std::max(p, q));
  const std::size_t place = told_.before(pair);
  return place < pairs() && told_.at(place) == pair ? place : pairs();
}

void PairEvents::release() {
  retire();
  begun_.release();
  ended_.release();
  next_numbers_.release();
  old_slots_.release();
  pieces_ = std::vector<Piece>();
  findings_ = std::vector<PairChanges>();
  told_.shrink();
  try {
    numbers_.shrink();
  } catch (const std::bad_alloc&) {  // they stay as they are
  }
}

}  // namespace ode_parallel_sap
