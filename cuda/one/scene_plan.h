// Plain data that the stages on the device leave for each other.
#ifndef ODE_PARALLEL_SAP_CUDA_SCENE_PLAN_H
#define ODE_PARALLEL_SAP_CUDA_SCENE_PLAN_H

#include <cstddef>
#include <cstdint>

#include "space/data/size_rules.h"

namespace ode_parallel_sap {
namespace device {

using size_rules::bins;
using size_rules::most_classes;

// A key is the class, then the place on the class's curve, in the top digits of 32.
constexpr int class_digits = 5;
constexpr int curve_digits = 32 - class_digits;
// The sort takes eight digits at a time. Up to this many boxes it is spared the last eight, which
// leaves two keys or more to a cell.
constexpr int short_key_digits = 24;
constexpr std::size_t most_short_keys = std::size_t{1} << 21;
constexpr int keyDigitsFor(std::size_t boxes) {
  return boxes <= most_short_keys ? short_key_digits : class_digits + curve_digits;
}
constexpr std::uint32_t no_key = 0xffffffff;  // of boxes that take part in nothing; sorted last

constexpr int cell_size = 32;  // a warp
// More boxes than this with one key are a crowd: its cells would have no order, and each would meet
// all others.
constexpr std::uint32_t crowd_size = 1024;
constexpr int fan_out = 32;  // children of a node
constexpr int most_levels = 6;

// Slots whose lists are sorted by one block.
constexpr int list_block = 256;
// Lists longer than this are sorted by themselves.
constexpr std::uint32_t long_list = 64;

// How the lists travel. The words of all lists follow each other: the later slot above the lowest
// bit, which tells that the pair is unsure. The top digits of a word tell by how many slots its
// earlier slot is ahead of the word's before: none within a list, one or a few at its beginning, or
// `far_ahead`: the next slot that has a list at all. Every stretch of words has a header that gives
// the earlier slot of its first word.
constexpr int ahead_shift = 29;
constexpr std::uint32_t far_ahead = 7;
constexpr std::uint32_t word_mask = (1u << ahead_shift) - 1;
constexpr std::size_t stretch_words = 1024;
constexpr std::size_t header_words = 4;  // keeps stretches aligned to 16 bytes
constexpr std::size_t stretch_size = header_words + stretch_words;

// Centre ranges as ordered integers (see ordered()), extents as sums of fixed-point numbers in
// units of the class's largest extent.
struct ClassSummary {
  int low[3], high[3];
  unsigned long long extent[3];
};

// What the host has to know before pairs can leave: whether all went well.
struct Counters {
  // Cleared before another search; nothing else is.
  unsigned long long found;       // places taken in the buffer of found pairs
  unsigned long long long_words;  // of all long lists
  std::uint32_t long_lists;
  std::uint32_t padding;

  std::uint32_t inactive;  // boxes
  std::uint32_t cells;
  std::uint32_t crowded;  // whether more boxes share a key than a search can bear
};

// Written on the device only. Cleared up to `table` before each frame.
struct ScenePlan {
  Counters counters;
  std::uint32_t histogram[bins];

  // From the classes on.
  std::uint8_t table[bins];  // class by bin
  std::uint32_t classes, active;
  std::uint32_t unbounded;  // the class of unbounded boxes, or none
  float unit[most_classes];
  ClassSummary summary[most_classes];
};

// What is a device's own where several share a scene (partition.h): the pairs of which not both
// boxes are guests, which begin before `first` on the axis.
struct Share {
  const std::uint32_t* slot_of = nullptr;  // by box, on the device; null: all is its own, box i is
                                           // that of slot i
  int axis = 0;
  std::uint64_t first = 0;
};

// Of a record, a box or the bounds of several: primitives.cuh.
constexpr std::size_t record_bytes = 32;

}  // namespace device
}  // namespace ode_parallel_sap

#endif
