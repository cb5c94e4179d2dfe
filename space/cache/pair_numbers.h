// Numbers for pairs while they last: the lowest free ones first.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>

#include "space/base/buffer.h"

namespace ode_parallel_sap {

class PairNumbers {
 public:
  using Number = unsigned;
  static constexpr std::size_t most = std::numeric_limits<Number>::max();

  // Room for `count` numbers in use. Throws std::bad_alloc; take() and give() do not.
  void reserve(std::size_t count) {
    if (count > most) throw std::bad_alloc();
    words_.growTo((count + word_numbers - 1) / word_numbers, ~std::uint64_t{0});
  }
  // The lowest free number. There is room.
  Number take() {
    while (words_[lowest_] == 0) ++lowest_;
    const int bit = __builtin_ctzll(words_[lowest_]);
    words_[lowest_] &= words_[lowest_] - 1;
    return static_cast<Number>(lowest_ * word_numbers + static_cast<std::size_t>(bit));
  }
  void give(Number number) {
    words_[number / word_numbers] |= std::uint64_t{1} << number % word_numbers;
    lowest_ = std::min(lowest_, number / word_numbers);
  }
  std::size_t bytes() const { return words_.bytes(); }

 private:
  static constexpr std::size_t word_numbers = 64;  // fixed: bits of a word

  Buffer<std::uint64_t> words_;  // a bit for each number, set while it is free
  std::size_t lowest_ = 0;       // no word before this one has a free one
};

}  // namespace ode_parallel_sap
