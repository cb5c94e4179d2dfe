// Plain data that the stages on the device leave for each other.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/device/tuning.h"
#include "cuda/one/size_rules.h"

namespace ode_parallel_sap {
namespace device {

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

// A long list in the number of all, which counts their words below: 512 GB of pairs.
constexpr unsigned long long one_long_list = 1ull << 36;
constexpr unsigned long long most_long_words = one_long_list - 1;

// Slots whose lists are sorted by one block.
constexpr int list_block = 256;  // fixed: a byte tells a list of a block

constexpr std::size_t segment_pairs = 1024;  // fixed: sorted pairs that share a mark: borderline

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
  unsigned long long pairs;       // in all lists
  unsigned long long long_lists;  // one_long_list each, and their words
  std::uint32_t cells_dealt;      // to warps that search, beyond those dealt in strides

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
