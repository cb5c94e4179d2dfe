// Boxes for libraries that compute in float.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "../peer.h"

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

// A library that is handed finished bounds, and told which boxes have moved.
class FloatPeer : public Peer {
 public:
  // Nothing has moved by this.
  void create(const Boxes& boxes) override {
    bounds_.reserve(boxes.size() + 1);  // PhysX loads four bytes past the last
    bounds_.resize(boxes.size());
    move(boxes);
    moved_.clear();
  }

  void move(const Boxes& boxes) override {
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

 protected:
  std::vector<FloatBox> bounds_;
  // Their numbers, ascending, until the next move or until find() clears them.
  std::vector<std::uint32_t> moved_;

 private:
  Boxes shown_;
};

}  // namespace bench
