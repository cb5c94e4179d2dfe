#include "mesh.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace pile {
namespace {

using Vector = std::array<double, 3>;

Vector toVector(const Mesh::Point& point) {
  return {point[0], point[1], point[2]};
}

double tripleProduct(const Vector& a, const Vector& b, const Vector& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

struct VolumeIntegrals {
  double volume = 0;
  Vector first{};                  // integral of x, y, z
  std::array<Vector, 3> second{};  // integral of the products of two coordinates
};

// Sums the signed tetrahedra (origin, triangle). For one of volume V with corners 0, a, b, c the
// integral of x is V/4 (a+b+c), that of x*y is V/20 (sum of corner products + product of sums).
VolumeIntegrals integrate(const Mesh& mesh) {
  VolumeIntegrals result;
  for (const Mesh::Triangle& triangle : mesh.triangles) {
    const Vector a = toVector(mesh.points[triangle[0]]);
    const Vector b = toVector(mesh.points[triangle[1]]);
    const Vector c = toVector(mesh.points[triangle[2]]);
    const double volume = tripleProduct(a, b, c) / 6;
    result.volume += volume;
    for (int i = 0; i < 3; ++i) {
      const double sum_i = a[i] + b[i] + c[i];
      result.first[i] += volume / 4 * sum_i;
      for (int j = 0; j < 3; ++j) {
        const double products = a[i] * a[j] + b[i] * b[j] + c[i] * c[j];
        result.second[i][j] += volume / 20 * (products + sum_i * (a[j] + b[j] + c[j]));
      }
    }
  }
  return result;
}

// True if every edge is shared by exactly two triangles of opposite direction: only then does the
// mesh enclose a volume, and has a mass.
bool isClosed(const Mesh& mesh) {
  std::vector<std::pair<dTriIndex, dTriIndex>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Mesh::Triangle& triangle : mesh.triangles)
    for (int i = 0; i < 3; ++i) edges.emplace_back(triangle[i], triangle[(i + 1) % 3]);
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return false;
  return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
    return std::binary_search(edges.begin(), edges.end(), std::pair(edge.second, edge.first));
  });
}

}  // namespace

dMass centreOfMass(Mesh& mesh, double density) {
  if (!isClosed(mesh)) throw std::logic_error("a body's mesh must be closed");
  const double volume = integrate(mesh).volume;
  if (!(volume > 0)) throw std::logic_error("a body's mesh is inside out");
  const Vector first = integrate(mesh).first;
  for (Mesh::Point& point : mesh.points)
    for (int i = 0; i < 3; ++i) point[i] -= static_cast<float>(first[i] / volume);

  const VolumeIntegrals centred = integrate(mesh);
  const auto inertia = [&](int i, int j) {
    const auto& second = centred.second;
    const double trace = second[0][0] + second[1][1] + second[2][2];
    return static_cast<dReal>(density * ((i == j ? trace : 0) - second[i][j]));
  };
  dMass mass;
  dMassSetParameters(&mass, static_cast<dReal>(density * centred.volume), 0, 0, 0, inertia(0, 0),
                     inertia(1, 1), inertia(2, 2), inertia(0, 1), inertia(0, 2), inertia(1, 2));
  return mass;
}

}  // namespace pile
