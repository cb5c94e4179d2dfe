// Boxes with room for their geoms to move in, so that pairs can be kept while everything moves a
// little.
#ifndef ODE_PARALLEL_SAP_LOOSE_BOXES_H
#define ODE_PARALLEL_SAP_LOOSE_BOXES_H

#include <algorithm>
#include <limits>

#include "box_set.h"

namespace ode_parallel_sap {

// All in parts of a box's extent along the axis, thin boxes' taken as at least a part of their
// longest one. On the sides towards which a geom moves, its box gets the room of as many frames
// like the last one as fit into most_room, on all sides at least least_room. A geom that would use
// most_room up in fewer frames than it takes for loose boxes to pay is fast.
constexpr float least_extent = 1.0f / 16;
constexpr float least_room = 1.0f / 32;
constexpr float most_room = 1.0f / 8;
constexpr float frames_ahead = 32;
constexpr float least_frames = 16;

// How a box moved in one frame: what its sides went outward by, in parts of its extents.
struct BoxMotion {
  float greatest;  // NaN is none
  bool fast() const { return greatest > most_room / least_frames; }
};

// Returns the longest one.
inline float extentsOf(const Box& box, float* extents) {
  float longest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    extents[axis] = box.upper[axis] - box.lower[axis];
    longest = std::max(longest, extents[axis]);
  }
  for (int axis = 0; axis < 3; ++axis)
    extents[axis] = std::max(extents[axis], longest * least_extent);
  return longest;
}

inline BoxMotion motionOf(const Box& before, const Box& now) {
  float extents[3];
  extentsOf(now, extents);
  BoxMotion motion = {0};
  for (int axis = 0; axis < 3; ++axis) {
    const float outward =
        std::max(before.lower[axis] - now.lower[axis], now.upper[axis] - before.upper[axis]);
    motion.greatest = std::max(motion.greatest, outward / extents[axis]);
  }
  return motion;
}

// The loose box of a bounded one. Contains it, whatever is rounded: what is added is not negative.
// A box that floats have no extents for gets no room, which would be all there is.
inline Box loosened(const Box& before, const Box& now) {
  float extents[3];
  if (extentsOf(now, extents) > std::numeric_limits<float>::max()) return now;
  Box loose;
  for (int axis = 0; axis < 3; ++axis) {
    const float least = least_room * extents[axis], most = most_room * extents[axis];
    const auto room = [&](float outward) {
      return least + std::min(std::max(0.0f, frames_ahead * outward), most);
    };
    loose.lower[axis] = now.lower[axis] - room(before.lower[axis] - now.lower[axis]);
    loose.upper[axis] = now.upper[axis] + room(now.upper[axis] - before.upper[axis]);
  }
  return loose;
}

inline bool contains(const Box& outer, const Box& inner) {
  bool contains = true;
  for (int axis = 0; axis < 3; ++axis)
    contains = contains && outer.lower[axis] <= inner.lower[axis] &&
               inner.upper[axis] <= outer.upper[axis];
  return contains;
}

}  // namespace ode_parallel_sap

#endif
