#include "coarse_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace pile {
namespace {

constexpr size_t few_triangles = 3000;
constexpr int cells_across = 20;  // of the longest side

float longestSide(const Mesh& mesh) {
  float longest = 0;
  for (size_t i = 0; i < 3; ++i) {
    const auto [low, high] = std::minmax_element(
        mesh.points.begin(), mesh.points.end(),
        [i](const Mesh::Point& a, const Mesh::Point& b) { return a[i] < b[i]; });
    longest = std::max(longest, (*high)[i] - (*low)[i]);
  }
  return longest;
}

}  // namespace

Mesh coarseMesh(const Mesh& mesh) {
  if (mesh.triangles.size() <= few_triangles) return mesh;
  const float cell = longestSide(mesh) / cells_across;
  Mesh coarse;
  std::vector<float> joined;  // how many points are in each of the coarse ones
  std::vector<dTriIndex> point_of;
  std::map<std::array<int, 3>, dTriIndex> cells;
  for (const Mesh::Point& point : mesh.points) {
    std::array<int, 3> key;
    for (size_t i = 0; i < 3; ++i) key[i] = static_cast<int>(std::floor(point[i] / cell));
    const auto [place, is_new] = cells.try_emplace(key, static_cast<dTriIndex>(cells.size()));
    if (is_new) {
      coarse.points.push_back({0, 0, 0});
      joined.push_back(0);
    }
    point_of.push_back(place->second);
    ++joined[place->second];
    for (size_t i = 0; i < 3; ++i) coarse.points[place->second][i] += point[i];
  }
  for (size_t p = 0; p < joined.size(); ++p)
    for (float& coordinate : coarse.points[p]) coordinate /= joined[p];
  for (const Mesh::Triangle& triangle : mesh.triangles) {
    const Mesh::Triangle moved = {point_of[triangle[0]], point_of[triangle[1]],
                                  point_of[triangle[2]]};
    if (moved[0] != moved[1] && moved[1] != moved[2] && moved[2] != moved[0])
      coarse.triangles.push_back(moved);
  }
  return coarse;
}

}  // namespace pile
