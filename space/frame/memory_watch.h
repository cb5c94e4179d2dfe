// When what a space holds has become too much for its scene.
#pragma once

#include <algorithm>
#include <cstddef>

#include "space/base/tuning.h"

namespace ode_parallel_sap {

// Storage is given back once many frames in a row have needed less than a quarter of it. Giving
// back all at once takes longer than a small frame, so each of the next frames gives back a part.
class MemoryWatch {
 public:
  static constexpr int none = -1;  // fixed: no part
  static constexpr int parts = 5;  // fixed: those of Pipeline::release(), and what the space has

  // A frame had so many geoms and pairs. The part of what is kept that is better given back, and
  // grown again by the next frame to the size of the last ones.
  int noteFrame(std::size_t geoms, std::size_t pairs) {
    // A geom takes about ten times the storage of a pair.
    const std::size_t need = 10 * geoms + pairs;
    if (need >= largest_ / 4) {
      largest_ = std::max(largest_, need);
      recent_ = 0;
      frames_ = 0;
      return none;
    }
    recent_ = std::max(recent_, need);
    if (largest_ < least_need || ++frames_ < idle_frames) return none;
    const int part = frames_ - idle_frames;
    if (part + 1 == parts) {
      largest_ = recent_;
      recent_ = 0;
      frames_ = 0;
    }
    return part;
  }

 private:
  static constexpr std::size_t least_need = 20000;  // fixed: some hundred KB are not worth it

  std::size_t largest_ = 0;  // of all frames since storage was given back
  std::size_t recent_ = 0;   // of the last frames_, all far below that
  int frames_ = 0;
};

}  // namespace ode_parallel_sap
