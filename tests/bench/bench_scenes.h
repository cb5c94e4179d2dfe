// Scenes in motion. The same name, size and seed give the same frames in every run, so that each
// peer is shown the same.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "centred_box.h"

namespace bench {

struct MovingScene {
  Boxes boxes;
  std::function<void(Boxes& boxes)> advance;  // to the next frame
  void next() { advance(boxes); }
};

constexpr std::size_t any_number = std::numeric_limits<std::size_t>::max();

struct SceneKind {
  std::string name, about;
  std::function<MovingScene(std::size_t n, std::uint64_t seed)> make;
  std::size_t most = any_number;  // boxes up to which the number of pairs is sensible
  std::size_t always = 0;         // boxes, whatever is asked for; 0: as many as that
};

// Of the same frames, but only a part of the boxes moves (0 to 1): in every frame the same ones,
// spread evenly over their numbers, or any.
MovingScene partlyMoving(MovingScene whole, double part, bool same = true);

// The distributions of the tests, more of them, and the piles recorded in the directory `piles`.
std::vector<SceneKind> sceneKinds(const std::string& piles);

}  // namespace bench
