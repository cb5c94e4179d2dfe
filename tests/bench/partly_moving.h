// A scene of which only a part moves, in every frame the same boxes, spread evenly over their
// numbers.
#pragma once

#include <cmath>
#include <memory>
#include <utility>

#include "bench_scenes.h"

namespace bench {

class PartlyMoving : public MovingScene {
 public:
  // `part` is 0 to 1.
  PartlyMoving(std::unique_ptr<MovingScene> whole, double part) : whole_(std::move(whole)) {
    boxes_ = whole_->boxes();
    for (std::size_t i = 0; i < boxes_.size(); ++i)
      if (std::floor(part * static_cast<double>(i + 1)) > std::floor(part * static_cast<double>(i)))
        movers_.push_back(i);
  }

  void advance() override {
    whole_->advance();
    for (const std::size_t i : movers_) boxes_[i] = whole_->boxes()[i];
  }

 private:
  const std::unique_ptr<MovingScene> whole_;
  std::vector<std::size_t> movers_;
};

}  // namespace bench
