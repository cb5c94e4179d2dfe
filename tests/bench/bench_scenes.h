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

// recorded_scenes.cpp: the frames of a trace as boxes. Bodies and bits are left out, as most peers
// know boxes only.

// "trace": the bounding boxes of the geoms that the traced space itself has, as many as there ever
// are in a frame. A geom that is not there in a frame, is disabled or has no finite bounding box is
// set aside, where it touches nothing. Reads the file; throws trace::BadTrace.
SceneKind traceScene(const std::string& path);

// "pile-<name>" of each <name>.trace that record-piles wrote into the directory: the bodies in the
// middle of the pile if fewer boxes are asked for, copies side by side if more.
std::vector<SceneKind> pileScenes(const std::string& directory);

}  // namespace bench
