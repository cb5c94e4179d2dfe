// Boxes divided by their filter bits, so that those which no bits let meet are in cells of their
// own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/data/box_set.h"
#include "space/data/buffer.h"

namespace ode_parallel_sap {

// What a number of boxes have in common by their bits: those that one of them has, and those that
// all have.
struct FilterSummary {
  std::uint32_t some_category = 0, some_collide = 0;
  std::uint32_t all_category = ~0u, all_collide = ~0u;

  void add(std::uint32_t category, std::uint32_t collide) {
    some_category |= category;
    some_collide |= collide;
    all_category &= category;
    all_collide &= collide;
  }
  void add(const FilterSummary& other) {
    some_category |= other.some_category;
    some_collide |= other.some_collide;
    all_category &= other.all_category;
    all_collide &= other.all_collide;
  }
};

// Whether the bits let any box of the one meet any of the other, and whether they let all.
inline bool someMayMeet(const FilterSummary& a, const FilterSummary& b) {
  return (a.some_category & b.some_collide) || (b.some_category & a.some_collide);
}
inline bool allMayMeet(const FilterSummary& a, const FilterSummary& b) {
  return (a.all_category & b.all_collide) || (b.all_category & a.all_collide);
}

class FilterGroups {
 public:
  // fixed: more kinds of bits are one group: each group's boxes walk every other group's tree.
  static constexpr std::size_t most = 4;

  // Chooses the groups for the boxes that are not NaN: one for each kind of bits, if there are few
  // kinds and much of all pairs is of kinds that do not meet, or else one for all.
  template <class Real>
  void choose(const BoxSet& boxes, int threads);

  std::size_t count() const { return count_; }
  // The group of each slot; null where there is but one.
  const std::uint8_t* ofSlots() const { return count_ > 1 ? group_of_slot_.data() : nullptr; }
  std::size_t bytes() const { return bytesOf(group_of_slot_, surveys_); }

 private:
  struct alignas(64) Survey {
    std::array<FilterBits, most> kinds;
    std::array<std::size_t, most> boxes;  // of each kind
    std::size_t count = 0;                // of kinds; `most` + 1 where there are more

    bool tooMany() const { return count > most; }
    void add(const FilterBits& bits, std::size_t boxes);
    std::size_t of(const FilterBits& bits) const;
    bool areMuchApart() const;
  };

  std::size_t count_ = 1;
  Buffer<std::uint8_t> group_of_slot_;
  std::vector<Survey> surveys_;
};

}  // namespace ode_parallel_sap
