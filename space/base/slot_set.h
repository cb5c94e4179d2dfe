// A set of slots: one bit each.
#pragma once

#include <cstdint>

#include "space/base/box_set.h"
#include "space/base/buffer.h"

namespace ode_parallel_sap {

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
  // Words of slots, for loops that share the work: threads may insert and erase in words of their
  // own.
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
