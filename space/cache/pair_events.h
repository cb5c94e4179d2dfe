// Which pairs of a space began and which ended from one frame to the next. Sees ODE's private
// headers.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/coherence/pair_changes.h"
#include "space/coherence/pair_numbers.h"
#include "space/coherence/told_pairs.h"
#include "space/data/buffer.h"
#include "space/data/pair_list.h"
#include "space/data/slot_set.h"

namespace ode_parallel_sap {

// Knows the pairs of the last frame that was told, by the slots of that time, with their numbers. A
// frame whose pairs are known to be the same costs nothing. Of one that went on from their list it
// is known what it changed; any other one is compared with them, in parts that threads share. Only
// if something begins or ends are the numbers of the next frame written.
//
// Slots are told apart by when their geoms came. One whose geom has left is marked; the next geom
// to sit in it is another one. When slots are closed up, those that stay keep their order, so a
// table of them is enough. Compared are the old pairs with the new ones in old slots, where geoms
// that came since have slots above all old ones, which leaves both ascending.
class PairEvents {
 public:
  using Event = dParallelSAPPairEvent;
  using Number = PairNumbers::Number;
  // Who found the pairs of a frame. That they are unchanged says only something of the last frame
  // from the same source.
  enum class Source { none, frame, small_scene };

  bool on() const { return on_; }
  // Begins without pairs, or forgets all.
  void turn(bool on);

  // The geom of a slot is leaving.
  void forget(Slot slot);
  // Slots are about to be closed up; null: no geom.
  void closeSlots(const Buffer<dxGeom*>& geoms);

  // The list is about to be written: what is still needed of it is taken out.
  void keep(PairList& pairs) { told_.keep(pairs); }
  // The pairs are those of the last frame of this source. False, and nothing told, where that says
  // nothing of the last told frame.
  bool tellSame(Source source);
  // Likewise, but for these changes. False without memory for it, too.
  bool tellChanged(const PairList& pairs, const std::vector<ChangedPiece>& changes,
                   const Buffer<dxGeom*>& geoms, Source source, int threads);
  // Says what began and ended from the last told frame to these pairs. Without memory for it
  // nothing is told, and false is returned: the next frame is compared with the last one that was
  // told. The pairs stay where they are, unless keep() takes them.
  bool tell(const PairList& pairs, const Buffer<dxGeom*>& geoms, Source source, int threads);
  // The frame has no list of pairs.
  void tellNothing();
  // A frame ran of which nothing was to be told.
  void passOver() { source_ = Source::none; }

  // Of the last frame, in the order of its pairs and of those of the last told one before it.
  const Buffer<Event>& begun() const { return begun_; }
  const Buffer<Event>& ended() const { return ended_; }
  // By place; of no pair if nothing was told.
  const Number* numbers() const { return numbers_.data(); }
  std::size_t pairs() const { return is_known_ ? told_.size() : 0; }
  // The place in the last frame of a pair of slots of now; pairs() if it has none.
  std::size_t placeOf(Slot a, Slot b) const;

  // Gives back what the next frame need not have, and what the last one told.
  void release();
  std::size_t bytes() const {
    return bytesOf(told_, numbers_, gone_, was_, free_, begun_, ended_, next_numbers_, old_slots_,
                   pieces_, findings_);
  }

 private:
  // A part of the new pairs, the old ones that belong before its end, and what was found there.
  struct Piece {
    const Pair *begin, *end;
    std::size_t place, old_begin, old_end;
    const PairChanges* changes;  // among which these are the piece's:
    std::size_t first_begun, begun, first_ended, ended;
    std::size_t begun_before, ended_before;  // in all pieces before
  };
  class Comparison;

  void retire();
  template <class Find>
  bool tellFound(const PairList& pairs, const Buffer<dxGeom*>& geoms, Source source, int threads,
                 Find find);
  const Slot* nameOldSlots(const Buffer<dxGeom*>& geoms);
  void takePieces(const PairList& pairs, const std::vector<ChangedPiece>& changes);
  void planPieces(const PairList& pairs, const Comparison& comparison, int threads);
  void findChanges(const Comparison& comparison, int threads);
  void addUp();
  void reserve(const PairList& pairs, std::size_t slots);
  void write(const Buffer<dxGeom*>& geoms, int threads);
  void writeEvents(const Piece& piece, const Buffer<dxGeom*>& geoms);
  void writeNumbers(const Piece& piece);
  Slot oldOf(Slot slot) const;
  dxGeom* geomOf(Slot old, const Buffer<dxGeom*>& geoms) const;

  bool on_ = false;
  Source source_ = Source::none;
  bool is_known_ = false;  // by the last frame
  // Of the last told frame.
  ToldPairs told_;
  Buffer<Number> numbers_;
  std::size_t last_slots_ = 0;
  // What happened to its slots since.
  SlotSet gone_;
  bool any_gone_ = false, closed_ = false;
  Buffer<Slot> was_;  // if closed_: the old slots of those slots that had geoms then; ascending

  PairNumbers free_;
  Buffer<Event> begun_, ended_;
  Buffer<Number> next_numbers_;
  Buffer<Slot> old_slots_;  // by slot, where slots have other names than then
  std::vector<Piece> pieces_;
  std::vector<PairChanges> findings_;  // one a thread
};

}  // namespace ode_parallel_sap
