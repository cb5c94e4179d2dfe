#include "mesh_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <utility>

namespace bench {
namespace {

namespace fs = std::filesystem;

constexpr double infinity = std::numeric_limits<double>::infinity();

constexpr KnownPairs known_pairs[] = {
    {"armadillo-rollers-326", 5262163, 2104628},
    {"cloth-funnel-227", 172385, 62771},
};

static_assert(sizeof(MeshBox) == 6 * sizeof(double), "boxes are read as they are");

MeshBoxes readBoxes(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  const std::streamoff bytes = file.tellg();
  if (bytes % std::streamoff{sizeof(MeshBox)})
    throw std::runtime_error(path + ": no whole number of boxes");
  MeshBoxes boxes(static_cast<std::size_t>(bytes) / sizeof(MeshBox));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(boxes.data()), bytes);
  return boxes;
}

// Triangles at one time.
struct Triangles {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
};

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && !text.compare(text.size() - end.size(), end.size(), end);
}

// The bounds of some corners in two frames.
class Corners {
 public:
  Corners(const Triangles& first, const Triangles& second) : first_(first), second_(second) {
    std::fill(box_.lower, box_.lower + 3, infinity);
    std::fill(box_.upper, box_.upper + 3, -infinity);
  }
  Corners& add(std::uint32_t vertex) {
    for (const Triangles* mesh : {&first_, &second_})
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box_.lower[axis] = std::min(box_.lower[axis], mesh->vertices[vertex][axis]);
        box_.upper[axis] = std::max(box_.upper[axis], mesh->vertices[vertex][axis]);
      }
    return *this;
  }
  MeshBox movedOutward() const {
    MeshBox box = box_;
    for (double& bound : box.lower) bound = std::nextafter(bound, -infinity);
    for (double& bound : box.upper) bound = std::nextafter(bound, infinity);
    return box;
  }

 private:
  const Triangles &first_, &second_;
  MeshBox box_;
};

// Boxes of what moves in a straight line between two frames.
Mesh boxesBetween(const std::string& name, const Triangles& first, const Triangles& second) {
  Mesh mesh;
  mesh.name = name;
  for (std::uint32_t vertex = 0; vertex < first.vertices.size(); ++vertex)
    mesh.vertices.push_back(Corners(first, second).add(vertex).movedOutward());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& face : first.faces) {
    mesh.faces.push_back(
        Corners(first, second).add(face[0]).add(face[1]).add(face[2]).movedOutward());
    for (std::size_t i = 0; i < 3; ++i) edges.push_back(std::minmax(face[i], face[(i + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  for (const auto& edge : edges)
    mesh.edges.push_back(Corners(first, second).add(edge.first).add(edge.second).movedOutward());
  return mesh;
}

// The cloth at a time: as wide as it has vertices, in waves of which four lie on one another.
Triangles clothAt(std::size_t side, double time) {
  Triangles cloth;
  const double n = static_cast<double>(side);
  for (std::size_t row = 0; row < side; ++row)
    for (std::size_t column = 0; column < side; ++column) {
      const double x = static_cast<double>(column), y = static_cast<double>(row);
      const double fold = 40 * x / n + time;
      cloth.vertices.push_back({x / 8 + 2 * std::sin(fold), y + std::sin(y + 3 * time),
                                3 * std::cos(fold) + 0.5 * std::sin(0.3 * y + time)});
      if (row + 1 == side || column + 1 == side) continue;
      const std::uint32_t at = static_cast<std::uint32_t>(row * side + column),
                          below = at + static_cast<std::uint32_t>(side);
      cloth.faces.push_back({at, at + 1, below});
      cloth.faces.push_back({at + 1, below + 1, below});
    }
  return cloth;
}

}  // namespace

Mesh madeCloth(std::size_t side) {
  return boxesBetween("made-cloth-" + std::to_string(side), clothAt(side, 0), clothAt(side, 0.1));
}

std::vector<Mesh> readMeshes(const std::string& directory) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(directory)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<Mesh> meshes;
  const std::string end = "-vertices.f64";
  for (const fs::path& path : paths) {
    const std::string file = path.string();
    if (endsWith(file, end)) {
      const std::string start = file.substr(0, file.size() - end.size());
      meshes.push_back({fs::path(start).filename().string(), readBoxes(file),
                        readBoxes(start + "-edges.f64"), readBoxes(start + "-faces.f64")});
    }
  }
  if (meshes.empty()) throw std::runtime_error(directory + ": no meshes");
  return meshes;
}

const KnownPairs* knownPairsOf(const std::string& mesh) {
  for (const KnownPairs& known : known_pairs)
    if (mesh == known.mesh) return &known;
  return nullptr;
}

std::size_t countPairs(const MeshBoxes& a, const MeshBoxes* b) {
  std::vector<std::pair<const MeshBox*, bool>> order;  // whose box it is
  for (const MeshBox& box : a) order.emplace_back(&box, false);
  if (b)
    for (const MeshBox& box : *b) order.emplace_back(&box, true);
  std::sort(order.begin(), order.end(),
            [](auto& x, auto& y) { return x.first->lower[0] < y.first->lower[0]; });
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const MeshBox& box = *order[i].first;
    for (std::size_t j = i + 1; j < order.size() && order[j].first->lower[0] <= box.upper[0]; ++j) {
      const MeshBox& other = *order[j].first;
      if (b && order[i].second == order[j].second) continue;
      pairs += box.lower[1] <= other.upper[1] && other.lower[1] <= box.upper[1] &&
               box.lower[2] <= other.upper[2] && other.lower[2] <= box.upper[2];
    }
  }
  return pairs;
}

}  // namespace bench
