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

constexpr std::size_t any_number = std::numeric_limits<std::size_t>::max();

struct SceneKind {
  std::string name;
  std::string about;
  std::size_t most = any_number;  // boxes up to which the number of pairs is sensible
  std::function<std::unique_ptr<MovingScene>(std::size_t n, std::uint64_t seed)> make;
  std::size_t always = 0;  // boxes, whatever is asked for; 0: as many as that
};

// The distributions of the tests, more of them, and the piles recorded in the directory `piles`.
std::vector<SceneKind> sceneKinds(const std::string& piles);

}  // namespace bench
