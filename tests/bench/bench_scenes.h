// Scenes in motion. The same name, size and seed give the same frames in every run, so that each
// peer is shown the same.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "centred_box.h"

namespace bench {

class MovingScene {
 public:
  virtual ~MovingScene() = default;
  const Boxes& boxes() const { return boxes_; }
  virtual void advance() = 0;

 protected:
  Boxes boxes_;
};

struct SceneKind {
  std::string name;
  std::string about;
  std::size_t most;  // boxes up to which the number of pairs is sensible
  std::function<std::unique_ptr<MovingScene>(std::size_t n, std::uint64_t seed)> make;
  std::size_t always = 0;  // boxes, whatever is asked for; 0: as many as that
};

// The distributions of the tests, more of them, frames recorded from piles where the directory
// `piles` has some, and edges of the meshes in the directory `meshes`, if it is not empty.
std::vector<SceneKind> sceneKinds(const std::string& piles, const std::string& meshes);

}  // namespace bench
