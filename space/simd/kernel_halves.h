// A region of boxes cut into cells by halving. Internal linkage, as in kernels_impl.h.
#pragma once

#include <string.h>

#include "space/simd/kernel_cells.h"

namespace {

constexpr std::size_t roundedToGroup(std::size_t count) {
  return (count + group_size - 1) / group_size * group_size;
}

// Cuts where a histogram says: those of the step in which the lower half ends may go either way.
class Halver {
 public:
  // Centres and slots are in four rows, which are aligned, so far apart.
  Halver(std::size_t stride, std::uint32_t* order, std::uint32_t* starts, std::uint32_t first)
      : stride_(stride), order_(order), starts_(starts), next_(first) {}

  // `rows` and `spare` have room for `count` and sixteen more, rounded up to sixteens.
  void halve(float* rows, float* spare, std::size_t count) {
    while (count > group_size) {
      // Whole nodes of the tree stay together where there are several.
      std::size_t unit = group_size;
      while (unit * group_size < count) unit *= group_size;
      const std::size_t lower = (count + unit - 1) / unit / 2 * unit;
      divide(rows, count, lower, spare);
      // What each half has left over is the other one's room.
      halve(spare, rows + roundedToGroup(count - lower), lower);
      spare += lower;
      count -= lower;
    }
    if (count == 0) return;
    *starts_++ = next_;
    memcpy(order_ + next_, rows + 3 * stride_, count * sizeof *order_);
    next_ += static_cast<std::uint32_t>(count);
  }

 private:
  using Floats = Register<float>::Type;
  static constexpr std::size_t lanes = Register<float>::lanes;

  static Floats& at(float* row) { return *reinterpret_cast<Floats*>(row); }
  static unsigned below(const float* row, float limit) {
    return ~Lanes::atLeast(row, limit) & all_lanes;
  }

  // The axis on which the centres lie farthest apart. Beyond the last one the rows repeat it.
  int longest(float* rows, std::size_t count, float& least, float& size) const {
    int longest = 0;
    size = -1;
    for (int axis = 0; axis < 3; ++axis) {
      float* const row = rows + axis * stride_;
      for (std::size_t i = count; i < roundedToGroup(count); ++i) row[i] = row[count - 1];
      Floats low = at(row), high = low;
      for (std::size_t i = lanes; i < count; i += lanes) {
        low = Register<float>::least(at(row + i), low);
        high = Register<float>::greatest(at(row + i), high);
      }
      float lowest = low[0], highest = high[0];
      for (std::size_t i = 1; i < lanes; ++i) {
        lowest = low[i] < lowest ? low[i] : lowest;
        highest = high[i] > highest ? high[i] : highest;
      }
      if (!(highest - lowest > size)) continue;
      longest = axis;
      least = lowest;
      size = highest - lowest;
    }
    return longest;
  }

  // Moves the lower half to `low`, and the rest to the front of the rows.
  void divide(float* rows, std::size_t count, std::size_t lower, float* low) const {
    float least = 0, size;
    const float* const row = rows + longest(rows, count, least, size) * stride_;
    const int steps = count > 1024 ? 256 : count > 128 ? 64 : 32;
    // All are one step where they are alike, or too far apart for a difference.
    const float factor = static_cast<float>(steps) * 0.999f / size;
    const float scale = size > 0 && factor > 0 && factor < __builtin_inff() ? factor : 0;
    // NaN, of what is infinite, is the first step.
    const auto stepsOf = [&](std::size_t i, float* step) {
      const Floats last_step = Floats{} + static_cast<float>(steps - 1);
      for (std::size_t lane = 0; lane < group_size; lane += lanes) {
        const Floats above = (at(const_cast<float*>(row) + i + lane) - least) * scale;
        at(step + lane) =
            Register<float>::least(Register<float>::greatest(above, Floats{}), last_step);
      }
    };
    alignas(64) float step[group_size] = {};
    std::uint32_t counts[256];
    memset(counts, 0, static_cast<std::size_t>(steps) * sizeof *counts);
    for (std::size_t i = 0; i < count; i += group_size) {
      stepsOf(i, step);
      for (int lane = 0; lane < group_size; ++lane)
        ++counts[static_cast<unsigned char>(static_cast<int>(step[lane]))];
    }
    // Beyond the last one the rows repeat it.
    counts[static_cast<unsigned char>(static_cast<int>(step[group_size - 1]))] -=
        static_cast<std::uint32_t>(roundedToGroup(count) - count);
    std::size_t below_last = 0;
    int last = 0;
    while (below_last + counts[last] <= lower && last + 1 < steps) below_last += counts[last++];
    std::size_t room = lower - below_last, to_low = 0, to_high = 0;
    for (std::size_t i = 0; i < count; i += group_size) {
      stepsOf(i, step);
      const unsigned used = count - i < group_size ? (1u << (count - i)) - 1 : all_lanes;
      unsigned is_low = below(step, static_cast<float>(last)) & used;
      unsigned in_last = below(step, static_cast<float>(last + 1)) & used & ~is_low;
      for (; in_last && room; in_last &= in_last - 1, --room) is_low |= in_last & (0u - in_last);
      const unsigned is_high = used & ~is_low;
      // What is written beyond has been read.
      Lanes::compress<4>(rows + i, stride_, is_low, low + to_low, stride_);
      Lanes::compress<4>(rows + i, stride_, is_high, rows + to_high, stride_);
      to_low += static_cast<std::size_t>(__builtin_popcount(is_low));
      to_high += static_cast<std::size_t>(__builtin_popcount(is_high));
    }
  }

  const std::size_t stride_;
  std::uint32_t *order_, *starts_, next_;
};

void cutIntoCells(const Centre* centres, std::size_t count, float* room, std::uint32_t first,
                  std::uint32_t* order, std::uint32_t* starts) {
  const std::size_t row_room = roundedToGroup(count) + 2 * group_size;
  for (std::size_t i = 0; i < count; ++i) {
    for (int axis = 0; axis < 3; ++axis) room[axis * row_room + i] = centres[i].at[axis];
    memcpy(room + 3 * row_room + i, &centres[i].slot, sizeof centres[i].slot);
  }
  Halver(row_room, order, starts, first).halve(room, room + 4 * row_room, count);
}

}  // namespace
