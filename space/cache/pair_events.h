// Which pairs of a space began and ended since the previous frame. Sees ODE's private headers.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <new>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/cache/changed_pairs.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

// Numbers for pairs and touches while they last: the lowest free ones first.
class PairNumbers {
 public:
  using Number = unsigned;
  static constexpr std::size_t most = std::numeric_limits<Number>::max();

  // Room for `count` more numbers. Throws std::bad_alloc; take() and give() do not.
  void reserve(std::size_t count) {
    if (count > most - unused_) throw std::bad_alloc();
    given_back_.growTo(unused_ + count);
  }
  // The lowest free number. There is room.
  Number take() {
    if (lowest_ < unused_) lowest_ = std::min(given_back_.firstFrom(lowest_), unused_);
    if (lowest_ == unused_) return lowest_++, unused_++;
    given_back_.erase(lowest_);
    return lowest_;
  }
  void give(Number number) {
    given_back_.insert(number);
    lowest_ = std::min(lowest_, number);
  }
  // Used numbers differ and are not free, and none below the lowest is free.
  void validate(std::vector<Number> used) const;
  std::size_t bytes() const { return bytesOf(given_back_); }

 private:
  SlotSet given_back_;  // the free ones below unused_
  Number lowest_ = 0;   // none below is free
  Number unused_ = 0;   // from here on none was ever taken
};

// Keeps a copy of the pairs of the previous frame, ascending, with their numbers, and merges it
// with the pairs of the next frame. A pair of both frames keeps its number and touch; each other
// pair is an event. The same loop writes the next copy. Threads share its pieces.
//
// A pair that the next frame leaves out only because it rests does not end. It is kept apart, with
// its number, until it is reported again or ends.
//
// Between two frames geoms leave their slots, and slots are closed up. So new pairs are compared by
// the slots of the previous frame. Geoms that came since get names above all of these slots. Geoms
// keep their order when slots are closed up, so new pairs ascend by these names, too.
class PairEvents {
 public:
  using Event = dParallelSAPPairEvent;
  using Number = PairNumbers::Number;

  void removeGeom(Slot slot);
  // The slots are about to be closed up; null: no geom.
  void closeSlots(const Buffer<dxGeom*>& geoms);

  // Compares the pairs of a frame with the previous pairs, and replaces these. Without memory it
  // returns false: the frame has no events, and the previous pairs stay for the next one.
  bool update(const PairList& pairs, const Buffer<dxGeom*>& geoms, const PairRules& rules,
              int threads);
  // The same for a frame whose pairs are those of the last frame. Returns false, and changes
  // nothing, if that had no events or slots changed since.
  bool updateSame();
  // The frame has no list of pairs, and so no events.
  void updateUnknown();

  // Of the last frame with events, both by place.
  const Buffer<Event>& begun() const { return begun_; }
  const Buffer<Event>& ended() const { return ended_; }
  bool hasEvents() const { return has_events_; }
  // The pairs of the last frame, by slots of then.
  const Buffer<Pair>& list() const { return previous_.pairs; }
  PairNumbers& pool() { return free_; }
  // From the next frame on, pairs keep their touches.
  void keepTouches() { keeps_touches_ = true; }
  void forgetTouches();
  // As numbers().
  Touch* touches() { return previous_.touches.data(); }
  // Touches whose pairs end in this frame, for who reports them and then empties the list; and
  // those of earlier frames that nobody reported. Their numbers are not given back.
  Buffer<Event>& endedTouches() { return ended_touches_; }
  Buffer<Event>& outlived() { return outlived_; }
  // Geoms of touches that have no pair have the bit of their space, until they leave one: at their
  // address another geom may come.
  static int touchingBit(const Buffer<dxGeom*>& geoms);
  static void forget(dxGeom* geom) { geom->gflags &= ~(nested_spaces * lowest_touching); }
  static void sortByPlace(Buffer<Event>& events);
  // Whether a pair is left out only because it rests.
  static bool rests(dxGeom* a, dxGeom* b, const PairRules& rules);
  // By place; of no pair if the last frame had no events.
  const Number* numbers() const { return previous_.numbers.data(); }
  std::size_t pairs() const { return has_events_ ? previous_.pairs.size() : 0; }
  // The place in the last frame of a pair of slots of now; pairs() if there is none.
  std::size_t placeOf(Slot a, Slot b) const;

  // Pairs ascend, each has a touch if these are kept, and the numbers of pairs that did not begin
  // are those of pairs that did not end.
  void validate() const;
  // Gives back the events, and storage that the next frame can do without.
  void release();
  std::size_t bytes() const {
    return bytesOf(previous_, next_, resting_, next_resting_, previous_slots_, free_, begun_,
                   ended_, ended_touches_, outlived_, previous_geoms_, spans_, changes_);
  }

 private:
  struct NumberedPairs {
    Buffer<Pair> pairs;
    Buffer<Number> numbers;
    Buffer<Touch> touches;  // if they are kept
    std::size_t bytes() const { return bytesOf(pairs, numbers, touches); }
  };
  // A pair that the next frame does not report.
  enum class State : unsigned char { ends, rests, rests_by_aabb_tests };
  struct Unreported {
    Pair pair;  // by slots of the previous frame
    std::size_t place;
    Number number;
    Touch touch;
    State state;
  };
  // Of a span: the places of pairs that begin, and those that are not reported.
  struct alignas(64) Changes {
    Buffer<std::size_t> begun;
    Buffer<Unreported> unreported;
    std::size_t bytes() const { return bytesOf(begun, unreported); }
  };

  // fixed: in gflags, where ODE uses the lower bits; four, so that spaces in spaces have their own.
  static constexpr int lowest_touching = 1 << 20, nested_spaces = 15;

  void trackSlots();
  void freeNumbers();
  void listPreviousGeoms(const Buffer<dxGeom*>& geoms);
  Slot previousSlot(Slot slot) const;
  Pair inPreviousSlots(Pair pair) const;
  dxGeom* previousGeom(Slot slot, const Buffer<dxGeom*>& geoms) const {
    return (slots_changed_ ? previous_geoms_ : geoms)[slot];
  }
  static State stateOf(const dxGeom* a, const dxGeom* b, const PairRules& rules);
  const Unreported* restingFrom(std::size_t span) const;
  Touch touchOf(std::size_t previous) const {
    return keeps_touches_ ? previous_.touches[previous] : no_touch;
  }
  void setNext(std::size_t place, Number number, Touch touch) {
    next_.numbers[place] = number;
    if (keeps_touches_) next_.touches[place] = touch;
  }
  std::size_t copyLasting(std::size_t place, std::size_t end, std::size_t previous,
                          std::size_t previous_end);
  void compare(std::size_t span, const Buffer<dxGeom*>& geoms, const PairRules& rules);
  void callAABBTests(const Buffer<dxGeom*>& geoms);
  void writeEvents(const Buffer<dxGeom*>& geoms);

  bool has_events_ = false;  // the last frame
  bool keeps_touches_ = false;
  NumberedPairs previous_, next_;
  Buffer<Unreported> resting_, next_resting_;  // ascending
  PairNumbers free_;
  Buffer<Event> begun_, ended_, ended_touches_, outlived_;

  // If slots changed since the previous pairs: by slot of now its geom's slot then, or no_slot.
  static constexpr Slot no_slot = ~Slot{0};
  Buffer<Slot> previous_slots_;
  bool slots_changed_ = false;
  std::size_t last_slots_ = 0;

  Buffer<dxGeom*> previous_geoms_;  // by previous slot, during an update, likewise
  std::vector<PairSpan> spans_;     // new pairs, and the previous ones that belong to them
  std::vector<Changes> changes_;    // of the spans
};

}  // namespace ode_parallel_sap
