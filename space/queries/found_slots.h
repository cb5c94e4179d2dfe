// The slots that a query finds, put in order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "space/base/buffer.h"
#include "space/base/slot_set.h"
#include "space/queries/tuning.h"

namespace ode_parallel_sap {

// Kept between queries, so that none of them allocates. One thread's.
class FoundSlots {
 public:
  // To be filled: each slot once, in any order.
  Buffer<Slot>& list() { return found_; }

  // Calls visit(slot) for each of the list, ascending: all are below `slots`. Few are sorted, many
  // ticked off. Throws std::bad_alloc before the first visit.
  template <class Visit>
  void forEachInOrder(std::size_t slots, Visit visit) {
    if (found_.size() < slots / many_hits + few_hits) {
      std::sort(found_.begin(), found_.end());
      for (const Slot slot : found_) visit(slot);
      return;
    }
    const std::size_t words = slots / word_slots + 1;
    growZeroed(marks_, words);
    growZeroed(marked_words_, words / word_slots + 1);
    for (const Slot slot : found_) {
      const std::size_t word = slot / word_slots;
      marks_[word] |= std::uint64_t{1} << slot % word_slots;
      marked_words_[word / word_slots] |= std::uint64_t{1} << word % word_slots;
    }
    for (std::size_t first = 0; first < words; first += word_slots)
      for (std::uint64_t& rest = marked_words_[first / word_slots]; rest; rest &= rest - 1) {
        const std::size_t word = first + __builtin_ctzll(rest);
        for (std::uint64_t bits = std::exchange(marks_[word], 0); bits; bits &= bits - 1)
          visit(static_cast<Slot>(word * word_slots + __builtin_ctzll(bits)));
      }
  }

  void release() { *this = FoundSlots(); }
  std::size_t bytes() const { return bytesOf(found_, marks_, marked_words_); }

 private:
  static constexpr std::size_t word_slots = SlotSet::word_slots;
  static constexpr std::size_t few_hits = 16;  // fixed: sorted by insertion, wherever they are

  static void growZeroed(Buffer<std::uint64_t>& words, std::size_t size) {
    const std::size_t before = words.size();
    if (size <= before) return;
    words.resize(size);
    std::fill(words.begin() + before, words.end(), 0);
  }

  Buffer<Slot> found_;
  // A bit a slot, and a bit for each word of those; all 0 between queries.
  Buffer<std::uint64_t> marks_, marked_words_;
};

}  // namespace ode_parallel_sap
