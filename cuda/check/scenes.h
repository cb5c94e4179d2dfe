// Boxes in all the distributions that a broad phase may meet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "space/base/box_set.h"

namespace cuda_check {

struct Scene {
  std::string name;
  std::size_t most;  // boxes up to which the number of pairs is sensible
  void (*fill)(std::size_t n, std::uint64_t seed, ode_parallel_sap::BoxSet& boxes);
};

const std::vector<Scene>& scenes();
const Scene& sceneOf(std::string_view name);

}  // namespace cuda_check
