// Plain data that the stages on the device leave for each other.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/device/tuning.h"
#include "cuda/one/size_rules.h"
#include "cuda/one/tuning.h"

namespace ode_parallel_sap {
namespace device {

using size_rules::bins;
using size_rules::most_classes;

// A key is the class, then the place on the class's curve, in the top digits of 32.
// fixed: they hold most_classes.
constexpr int class_digits = 5;
static_assert(1 << class_digits >= most_classes, "a class has a number");
constexpr int curve_digits = 32 - class_digits;
// fixed: the sort takes eight digits at a time, and is spared the last eight.
constexpr int short_key_digits = 24;
constexpr int keyDigitsFor(std::size_t boxes) {
  return boxes <= most_short_keys ? short_key_digits : class_digits + curve_digits;
}
constexpr std::uint32_t no_key = 0xffffffff;  // of boxes that take part in nothing; sorted last

constexpr int cell_size = 32;  // fixed: a warp's lanes
constexpr int fan_out = 32;    // fixed: likewise, the children of a node
// fixed: enough for 2^28 boxes.
constexpr int most_levels = 6;

// Lists longer than this are sorted by digits, all of them together; the others by one thread each.
constexpr std::uint32_t long_list = 32;  // fixed: registers hold so many words

// Slots whose lists are sorted by one block.
constexpr int list_block = 256;  // fixed: a byte tells a list of a block

// How the lists travel. The words of all lists follow each other: the later slot above the lowest
// bit, which tells that the pair is borderline. The top digits of a word tell by how many slots its
// earlier slot is ahead of the word's before: none within a list, one or a few at its beginning, or
// `far_ahead`: the next slot that has a list at all. Every segment of words has a header that gives
// the earlier slot of its first word.
// fixed: 29 bits hold a slot and a mark; a header keeps segments aligned to 16 bytes, and takes
// 0.4 % of them.
constexpr int ahead_shift = 29;
constexpr std::uint32_t far_ahead = 7;
constexpr std::uint32_t word_mask = (1u << ahead_shift) - 1;
constexpr std::size_t segment_words = 1024;
constexpr std::size_t header_words = 4;
constexpr std::size_t segment_size = header_words + segment_words;

// Centre ranges as ordered integers (see ordered()), extents as sums of fixed-point numbers in
// units of the class's largest extent.
struct ClassSummary {
  int low[3], high[3];
  unsigned long long extent[3];
};

// Slots [begin, end).
struct SlotRange {
  std::uint32_t begin, end;
};

// Pairs [begin, end) of all lists.
struct PairRange {
  unsigned long long begin, end;
};

// What the host has to know before pairs can leave: whether all went well.
struct Counters {
  // Cleared before another search; nothing else is.
  unsigned long long found;       // places taken in the buffer of found pairs
  unsigned long long long_words;  // of all long lists
  std::uint32_t long_lists;
  std::uint32_t cells_dealt;  // to warps that search, beyond those dealt in strides

  std::uint32_t inactive;  // boxes
  std::uint32_t cells;
  std::uint32_t clustered;  // whether more boxes share a key than a search can bear

  // Whose lists are the device's own, where several share the scene.
  SlotRange own;
};

// Written on the device only. Cleared up to `table` before each frame.
struct ScenePlan {
  Counters counters;
  PairRange own_pairs;  // of those slots
  std::uint32_t histogram[bins];

  // From the classes on.
  std::uint8_t table[bins];  // class by bin
  std::uint32_t classes, active;
  std::uint32_t unbounded;  // the class of unbounded boxes, or none
  float unit[most_classes];
  ClassSummary summary[most_classes];
};

// Boxes of 24 bytes in some order: the i-th is that with the number slots[i].
struct OrderedBoxes {
  const float* boxes;
  const std::uint32_t* slots;
  std::size_t count;
};

// What is a device's own of a scene that `count` devices have: every count-th group of cells to
// search, and the lists of one range of slots.
constexpr int most_parts = 16;  // fixed: as many devices as a machine has; a limit of arrays
struct Part {
  std::uint32_t index = 0, count = 1;
};

// fixed: the size of a record, a box or the bounds of several: primitives.cuh.
constexpr std::size_t record_bytes = 32;

}  // namespace device
}  // namespace ode_parallel_sap
