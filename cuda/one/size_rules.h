// How the stage `classify` divides boxes by size and shape. For kernels and, in tests, the host.
#pragma once

#include <cstdint>

#include "space/base/both_sides.h"

namespace ode_parallel_sap {
namespace device {

constexpr int most_classes = 24;  // fixed: a key holds their number in five digits
constexpr int octaves = 256;      // fixed: exponents of a float
constexpr int unbounded_octave = octaves - 1;
constexpr int shapes = 8;  // fixed: for each axis: about as long as the longest, or far shorter
constexpr int bins = octaves * shapes;
// fixed: fewer boxes than this are too few for a class in any case.
constexpr std::uint32_t least_shape_count = 64;

// Sizes within a factor of two to the power of this share a class: cells of mixed sizes are then at
// most as wide as their largest boxes, and boxes of one size rarely straddle two classes.
constexpr int class_octaves = 4;
// A class of sizes ends where there are this many times fewer larger boxes. Among many larger ones
// small boxes do no harm, and each class more is a tree more to walk, though all in one go.
constexpr std::uint32_t fewer_larger = 8;
// A box is short along an axis where it is shorter there by a factor of two to the power of this
// than along its longest one.
constexpr int shape_octaves = 3;
// A shape (long in some axes, short in others) gets a class from this share of its window on.
constexpr std::uint32_t least_shape_share = 16;

constexpr int most_windows = most_classes / 2;
constexpr std::uint8_t no_class = 0xff;

ODE_PARALLEL_SAP_BOTH_SIDES inline int octaveOf(float extent) {
  const std::int32_t bits = bitsOf(extent);
  const bool nan = (bits & 0x7fffffff) > 0x7f800000;
  return bits < 0 && !nan ? 0 : bits >> 23 & 0xff;
}

// The octave of the greatest extent, and for each axis whether the extent there is far shorter.
ODE_PARALLEL_SAP_BOTH_SIDES inline int binOf(float extent_x, float extent_y, float extent_z) {
  const int x = octaveOf(extent_x), y = octaveOf(extent_y), z = octaveOf(extent_z);
  const int greater = x > y ? x : y, greatest = greater > z ? greater : z;
  if (greatest == unbounded_octave) return unbounded_octave * shapes;
  return greatest * shapes + (greatest - x >= shape_octaves) + (greatest - y >= shape_octaves) * 2 +
         (greatest - z >= shape_octaves) * 4;
}

// Consecutive octaves whose boxes share classes.
struct Window {
  int first, last;
  std::uint32_t count;  // of boxes
};

// Puts windows that do not overlap in order and joins some of them, in place: a class ends where
// the boxes that are larger are clearly fewer, or of quite another size. Too many join as well.
// Returns how many are left. `bounded` boxes are in all of them.
ODE_PARALLEL_SAP_BOTH_SIDES inline int arrangeWindows(Window* windows, int count,
                                                      std::uint32_t bounded) {
  for (int i = 1; i < count; ++i)
    for (int j = i; j > 0 && windows[j].first < windows[j - 1].first; --j) {
      const Window swapped = windows[j];
      windows[j] = windows[j - 1];
      windows[j - 1] = swapped;
    }
  int kept = 0;  // never overtakes i
  std::uint64_t up_to = 0;
  for (int i = 0; i < count; ++i) {
    up_to += windows[i].count;
    const bool few_larger = (bounded - up_to) * fewer_larger <= windows[i].count;
    const bool ends =
        i + 1 == count || (kept + count - i <= most_windows &&
                           (few_larger || windows[i + 1].first - windows[i].last > class_octaves));
    if (!ends) {
      windows[i + 1].first = windows[i].first;
      up_to -= windows[i].count;
      windows[i + 1].count += windows[i].count;
    } else {
      windows[kept++] = windows[i];
    }
  }
  return kept;
}

// Splits a window by shape where a shape is common, of which `counts` tells. Classes are numbered
// from `classes` on; the shapes that get none of their own share one, and those of which there is
// no box get no_class. `windows_left` windows follow. Returns the number of all classes so far.
ODE_PARALLEL_SAP_BOTH_SIDES inline int splitWindow(const std::uint32_t* counts, std::uint32_t count,
                                                   int windows_left, int classes,
                                                   std::uint8_t* class_of_shape) {
  const std::uint32_t share = count / least_shape_share;
  const std::uint32_t least = share > least_shape_count ? share : least_shape_count;
  const int classes_left = most_classes - 1 - classes - windows_left;
  int used = 0, shared = -1;
  for (int shape = 0; shape < shapes; ++shape) {
    class_of_shape[shape] = no_class;
    if (counts[shape] < least || used + 1 >= classes_left) continue;
    class_of_shape[shape] = static_cast<std::uint8_t>(classes++);
    ++used;
  }
  for (int shape = 0; shape < shapes; ++shape) {
    if (class_of_shape[shape] != no_class || counts[shape] == 0) continue;
    if (shared < 0) shared = classes++;
    class_of_shape[shape] = static_cast<std::uint8_t>(shared);
  }
  return classes;
}

}  // namespace device
}  // namespace ode_parallel_sap
