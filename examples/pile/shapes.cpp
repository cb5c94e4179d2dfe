#include "shapes.h"

#include <algorithm>
#include <cmath>

namespace pile {
namespace {

constexpr double two_pi = 6.283185307179586;

struct ProfilePoint {
  double radius;
  double height;
};

Mesh::Point point(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

void addTriangle(Mesh& mesh, size_t a, size_t b, size_t c) {
  mesh.triangles.push_back(
      {static_cast<dTriIndex>(a), static_cast<dTriIndex>(b), static_cast<dTriIndex>(c)});
}

void addQuad(Mesh& mesh, size_t a, size_t b, size_t c, size_t d) {
  addTriangle(mesh, a, b, c);
  addTriangle(mesh, a, c, d);
}

void addRing(Mesh& mesh, const ProfilePoint& profile, int segments) {
  for (int i = 0; i < segments; ++i) {
    const double angle = two_pi * i / segments;
    mesh.points.push_back(
        point(profile.radius * std::cos(angle), profile.radius * std::sin(angle), profile.height));
  }
}

// Rings from the bottom up around a lowest point; front side outwards. Leaves the top open.
Mesh revolve(double bottom, const std::vector<ProfilePoint>& rings, int segments) {
  Mesh mesh;
  mesh.points.push_back(point(0, 0, bottom));
  for (const ProfilePoint& ring : rings) addRing(mesh, ring, segments);
  const auto index = [&](size_t ring, int i) { return 1 + ring * segments + i % segments; };
  for (int i = 0; i < segments; ++i) addTriangle(mesh, 0, index(0, i + 1), index(0, i));
  for (size_t ring = 0; ring + 1 < rings.size(); ++ring)
    for (int i = 0; i < segments; ++i)
      addQuad(mesh, index(ring, i), index(ring, i + 1), index(ring + 1, i + 1), index(ring + 1, i));
  return mesh;
}

// Height and diameter of a pin in inches, after the specification of the United States Bowling
// Congress; the base is rounded off and the head is a sphere.
struct OutlinePoint {
  double diameter;
  double height;
};
constexpr OutlinePoint pin_outline[] = {
    {2.031, 0},      {2.828, 0.75},  {3.906, 2.25},   {4.510, 3.375}, {4.766, 4.5},
    {4.563, 5.875},  {3.703, 7.25},  {2.472, 8.625},  {1.965, 9.375}, {1.797, 10},
    {1.870, 10.875}, {2.094, 11.75}, {2.406, 12.625}, {2.547, 13.5}};
constexpr double pin_height = 15;
constexpr double head_radius = 1.2735;

double pinRadius(double height) {
  const auto* const last = std::end(pin_outline) - 1;
  if (height >= last->height) {
    const double from_centre = height - (pin_height - head_radius);
    return std::sqrt(std::max(0.0, head_radius * head_radius - from_centre * from_centre));
  }
  const auto* upper =
      std::upper_bound(std::begin(pin_outline), std::end(pin_outline), height,
                       [](double h, const OutlinePoint& p) { return h < p.height; });
  const OutlinePoint& a = upper[-1];
  const OutlinePoint& b = upper[0];
  const double t = (height - a.height) / (b.height - a.height);
  return 0.5 * (a.diameter + t * (b.diameter - a.diameter));
}

}  // namespace

Mesh makeTorus(double ring_radius, double tube_radius) {
  constexpr int around = 48;
  constexpr int across = 24;
  Mesh mesh;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double u = two_pi * i / around;
      const double v = two_pi * j / across;
      const double radius = ring_radius + tube_radius * std::cos(v);
      mesh.points.push_back(
          point(radius * std::cos(u), radius * std::sin(u), tube_radius * std::sin(v)));
    }
  const auto index = [](int i, int j) { return (i % around) * across + j % across; };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j)
      addQuad(mesh, index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
  return mesh;
}

Mesh makeSkittle(double height, int segments) {
  const int ring_count = segments;
  const double scale = height / pin_height;
  std::vector<ProfilePoint> rings;
  for (int i = 0; i < ring_count; ++i) {
    // Denser towards the top, where the head closes.
    const double t = static_cast<double>(i) / ring_count;
    const double level = pin_height * std::sin(0.25 * two_pi * t);
    rings.push_back({scale * pinRadius(level), scale * level});
  }
  Mesh mesh = revolve(0, rings, segments);
  const size_t top = mesh.points.size();
  mesh.points.push_back(point(0, 0, height));
  const size_t last_ring = top - segments;
  for (int i = 0; i < segments; ++i)
    addTriangle(mesh, last_ring + i, last_ring + (i + 1) % segments, top);
  return mesh;
}

double Bowl::ringHeight(double radius) const {
  const double t = radius / radius_;
  return depth_ * t * t;
}

Mesh Bowl::mesh() const {
  constexpr int segments = 40;
  constexpr int ring_count = 8;
  std::vector<ProfilePoint> rings;
  for (int i = 1; i <= ring_count; ++i) {
    const double radius = radius_ * i / ring_count;
    rings.push_back({radius, ringHeight(radius)});
  }
  Mesh mesh = revolve(0, rings, segments);
  for (Mesh::Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

double Bowl::height(double x, double y) const {
  return ringHeight(std::hypot(x, y));
}

double Terrain::height(double x, double y) const {
  const double scale = cell_size_ / 0.5;  // larger cells make the same terrain larger
  const double u = x / halfWidth();
  const double v = y / halfLength();
  const double valley = 14 * (u * u + v * v);
  x *= two_pi / scale;
  y *= two_pi / scale;
  const double hills = 1.2 * std::sin(x / 23) * std::sin(y / 19);
  const double bumps = 0.1 * std::sin(x / 3.7) * std::cos(y / 4.3);
  return scale * (valley + hills + bumps);
}

Mesh Terrain::tile(int tile_x, int tile_y) const {
  Mesh mesh;
  const int row = tile_cells + 1;
  for (int j = 0; j < row; ++j)
    for (int i = 0; i < row; ++i) {
      const double x = cell_size_ * (tile_x * tile_cells + i) - halfWidth();
      const double y = cell_size_ * (tile_y * tile_cells + j) - halfLength();
      mesh.points.push_back(point(x, y, height(x, y)));
    }
  for (int j = 0; j < tile_cells; ++j)
    for (int i = 0; i < tile_cells; ++i) {
      const size_t corner = static_cast<size_t>(j) * row + i;
      addQuad(mesh, corner, corner + 1, corner + row + 1, corner + row);
    }
  return mesh;
}

}  // namespace pile
