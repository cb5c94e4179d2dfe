// Scenes whose pairs want images of ODE, for programs built from the library's objects.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdint>

#include "contact_scene.h"
#include "teams.h"

namespace sap_test {

// Meshes and heightfields in a heap of others.
inline void fillForImages(ContactScene& scene, std::uint64_t seed) {
  scene.add(Kind::Plane, 0, seed);
  scene.fill({Kind::Torus, Kind::Box, Kind::Sphere, Kind::Capsule, Kind::Cylinder, Kind::Convex},
             300, seed);
  for (std::uint64_t i = 0; i < 4; ++i) scene.add(Kind::Heightfield, 5, seed + i);
}

// Whether ODE has one cache of meshes for all threads.
inline bool meshesNeedImages() {
  return !dCheckConfiguration("ODE_EXT_mt_collisions");
}

// How often two threads or more had pairs on images.
inline std::uint64_t timesOnImages() {
  return timesShared().at("contacts: pairs on images");
}

}  // namespace sap_test
