// For libraries that get the boxes that have moved: bounds as they want them, and the numbers of
// those that are not what they were.
#pragma once

#include <cstdint>
#include <vector>

#include "../centred_box.h"

namespace bench {

// `Bounds` is the library's box, made by `toBounds`.
template <class Bounds>
class MovedBoxes {
 public:
  using Maker = Bounds (*)(const CentredBox&);
  explicit MovedBoxes(Maker to_bounds) : to_bounds_(to_bounds) {}

  // Nothing has moved by this.
  void create(const Boxes& boxes) {
    boxes_ = boxes;
    bounds_.clear();
    // PhysX loads four bytes past the last.
    bounds_.reserve(boxes.size() + 1);
    for (const CentredBox& box : boxes) bounds_.push_back(to_bounds_(box));
    moved_.clear();
  }

  void move(const Boxes& boxes) {
    moved_.clear();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (boxes[i] == boxes_[i]) continue;
      boxes_[i] = boxes[i];
      bounds_[i] = to_bounds_(boxes[i]);
      moved_.push_back(static_cast<Index>(i));
    }
  }

  // To be called by each find: a second one without a move finds nothing moved.
  void taken() { moved_.clear(); }

  using Index = std::uint32_t;
  std::size_t size() const { return bounds_.size(); }
  const std::vector<Bounds>& bounds() const { return bounds_; }
  const std::vector<Index>& moved() const { return moved_; }

 private:
  const Maker to_bounds_;
  Boxes boxes_;
  std::vector<Bounds> bounds_;
  std::vector<Index> moved_;  // ascending
};

}  // namespace bench
