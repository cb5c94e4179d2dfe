// Boxes for libraries that compute in float.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "../centred_box.h"

namespace bench {

// Rounded outward, so that no pair is lost.
inline float floatBelow(double value) {
  const float rounded = static_cast<float>(value);
  return rounded > value ? std::nextafter(rounded, -std::numeric_limits<float>::infinity())
                         : rounded;
}
inline float floatAbove(double value) {
  return -floatBelow(-value);
}

struct FloatBox {
  float low[3], high[3];
};

// The numbers of the boxes that have moved, for libraries that are told of these.
class FloatBoxes {
 public:
  // Nothing has moved by this.
  void create(const Boxes& boxes) {
    shown_.clear();
    bounds_.reserve(boxes.size() + 1);  // PhysX loads four bytes past the last
    bounds_.resize(boxes.size());
    move(boxes);
    moved_.clear();
  }

  void move(const Boxes& boxes) {
    moved_.clear();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (!shown_.empty() && boxes[i] == shown_[i]) continue;
      moved_.push_back(static_cast<std::uint32_t>(i));
      for (int axis = 0; axis < 3; ++axis) {
        bounds_[i].low[axis] = floatBelow(boxes[i].low(axis));
        bounds_[i].high[axis] = floatAbove(boxes[i].high(axis));
      }
    }
    shown_ = boxes;
  }

  // To be called by each find: a second one without a move finds nothing moved.
  void taken() { moved_.clear(); }

  const std::vector<FloatBox>& bounds() const { return bounds_; }
  const std::vector<std::uint32_t>& moved() const { return moved_; }  // ascending

 private:
  Boxes shown_;
  std::vector<FloatBox> bounds_;
  std::vector<std::uint32_t> moved_;
};

}  // namespace bench
