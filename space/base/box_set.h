// The boxes of one frame, from the update stage to the extraction on any back end; sets of slots.
#pragma once

#include <cstdint>
#include <limits>
#include <type_traits>

#include "space/base/buffer.h"

namespace ode_parallel_sap {

// Slots number the geoms of a space in the order in which they were last added, gaps allowed. Pairs
// are pairs of slots, and ascending slots are the order of the report. Slots stay below 2^28.
using Slot = std::uint32_t;

// An axis-aligned box. All bounds NaN: a slot that takes part in nothing.
template <class Real>
struct BasicBox {
  Real lower[3], upper[3];
};
using Box = BasicBox<float>;

template <class Real>
inline bool isActive(const BasicBox<Real>& box) {
  return box.lower[0] == box.lower[0];
}

template <class Real>
constexpr BasicBox<Real> inactiveBox() {
  constexpr Real nan = std::numeric_limits<Real>::quiet_NaN();
  return {{nan, nan, nan}, {nan, nan, nan}};
}

template <class Real>
inline bool overlap(const BasicBox<Real>& a, const BasicBox<Real>& b) {
  bool overlap = true;
  for (int axis = 0; axis < 3; ++axis)
    overlap &= a.lower[axis] <= b.upper[axis] && b.lower[axis] <= a.upper[axis];
  return overlap;
}

// The exact box, of bounds as ODE keeps them: lower and upper on each axis.
template <class Real, class Bound>
inline BasicBox<Real> boxOfBounds(const Bound* bounds) {
  return {{bounds[0], bounds[2], bounds[4]}, {bounds[1], bounds[3], bounds[5]}};
}

// ODE's bits. Two geoms may collide if either's category meets the other's collide bits.
struct FilterBits {
  std::uint32_t category, collide;
};
struct WideFilterBits {
  std::uint64_t category, collide;
};

// A body's address; 0: no body.
using BodyKey = std::uint64_t;
// Stands for the bodies of geoms at rest, no pairs of which are wanted. No body lies there.
constexpr BodyKey resting_body = 1;

// Boxes and filters by slot. Boxes are the nearest floats (round_to_floats.h), or, in scenes so far
// from the origin for their size that floats would tell too few of them apart, the exact doubles.
struct BoxSet {
  std::size_t size = 0;  // slots
  bool wide = false;     // which of the two is filled
  Buffer<BasicBox<float>> boxes;
  Buffer<BasicBox<double>> wide_boxes;
  Buffer<FilterBits> bits;           // read if filter_bits
  Buffer<WideFilterBits> wide_bits;  // all of a geom's, if these do not decide alike
  // Equal and not 0, if filter_bodies: on the same body, or both at rest, and no pair.
  Buffer<BodyKey> bodies;
  bool filter_bits = false;
  bool filter_bodies = false;
  bool exact = false;  // whether no pair needs the exact test

  // Room for so many slots, with what there was.
  void resize(std::size_t slots) {
    size = slots;
    wide ? wide_boxes.resize(slots) : boxes.resize(slots);
    bits.resize(slots);
    if (wide_bits.data()) wide_bits.resize(slots);
    bodies.resize(slots);
  }
  void deactivate(Slot slot) {
    if (wide)
      wide_boxes[slot] = inactiveBox<double>();
    else
      boxes[slot] = inactiveBox<float>();
  }
  std::size_t bytes() const { return bytesOf(boxes, wide_boxes, bits, wide_bits, bodies); }
};

template <class Real>
Buffer<BasicBox<Real>>& boxBufferOf(BoxSet& boxes) {
  if constexpr (std::is_same<Real, float>::value)
    return boxes.boxes;
  else
    return boxes.wide_boxes;
}
template <class Real>
const BasicBox<Real>* boxesOf(const BoxSet& boxes) {
  return boxBufferOf<Real>(const_cast<BoxSet&>(boxes)).data();
}

class SlotSet {
 public:
  static constexpr std::size_t word_slots = 64;  // fixed: bits of a word

  void insert(Slot slot) { words_[slot / word_slots] |= bitOf(slot); }
  // Many threads may do so at once. Returns whether it was not there.
  bool insertShared(Slot slot) {
    std::uint64_t* const word = &words_[slot / word_slots];
    return !(__atomic_fetch_or(word, bitOf(slot), __ATOMIC_RELAXED) & bitOf(slot));
  }
  void erase(Slot slot) { words_[slot / word_slots] &= ~bitOf(slot); }
  bool contains(Slot slot) const { return (words_[slot / word_slots] & bitOf(slot)) != 0; }

  // Makes room for slots below `slots`; never less than before.
  void growTo(std::size_t slots) { words_.growTo((slots + word_slots - 1) / word_slots, 0); }
  void clear() {
    for (std::uint64_t& word : words_) word = 0;
  }
  std::size_t count() const {
    std::size_t slots = 0;
    for (const std::uint64_t word : words_)
      if (word) slots += __builtin_popcountll(word);  // a function call, and most words are empty
    return slots;
  }
  // Words of slots, for loops that share the work: threads may change words of their own.
  std::size_t words() const { return words_.size(); }
  std::uint64_t word(std::size_t i) const { return words_[i]; }
  void setWord(std::size_t i, std::uint64_t slots) { words_[i] = slots; }

  // Calls visit(slot) for all slots, ascending.
  template <class Visit>
  void forEach(Visit visit) const {
    for (std::size_t i = 0; i < words(); ++i)
      for (std::uint64_t word = words_[i]; word; word &= word - 1)
        visit(static_cast<Slot>(i * word_slots + __builtin_ctzll(word)));
  }
  // Leaves those below `slots` in `list`, ascending.
  void listBelow(std::size_t slots, Buffer<Slot>& list) const {
    list.resizeDiscarding(0);
    forEach([&](Slot slot) {
      if (slot < slots) list.push_back(slot);
    });
  }

  // The first slot of the set that is not before `slot`; if there is none, past all.
  Slot firstFrom(Slot slot) const {
    std::size_t i = slot / word_slots;
    if (i >= words()) return static_cast<Slot>(words() * word_slots);
    std::uint64_t bits = words_[i] >> slot % word_slots << slot % word_slots;
    while (!bits && ++i < words()) bits = words_[i];
    return static_cast<Slot>(i * word_slots + (bits ? __builtin_ctzll(bits) : 0));
  }

  std::size_t bytes() const { return words_.bytes(); }

 private:
  static std::uint64_t bitOf(Slot slot) { return std::uint64_t{1} << slot % word_slots; }

  Buffer<std::uint64_t> words_;
};

}  // namespace ode_parallel_sap
