#ifndef PILE_SHAPES_H
#define PILE_SHAPES_H

#include "mesh.h"

namespace pile {

// 48 x 24 quads: 2,304 triangles. The axis is z.
Mesh makeTorus(double ring_radius, double tube_radius);

// A bowling pin standing along z, with the outline of a regulation pin: so many rings of so many
// segments, 20,000 triangles for 100.
Mesh makeSkittle(double height, int segments);

// A bowl of 600 triangles, open at the top: 40 segments round the z axis, 8 rings.
class Bowl {
 public:
  Bowl(double radius, double depth) : radius_(radius), depth_(depth) {}
  Mesh mesh() const;
  // Height of the bowl over (x, y), seen as perfectly round: nowhere above the mesh's.
  double height(double x, double y) const;

 private:
  double ringHeight(double radius) const;

  double radius_;
  double depth_;
};

// Hills in a wide valley: a grid of 400 x 375 cells of two triangles each, 300,000 triangles, cut
// into 16 x 15 tiles. Neighbouring tiles compute their common border from the same grid points, so
// that they fit without gaps.
class Terrain {
 public:
  static constexpr int tiles_x = 16;
  static constexpr int tiles_y = 15;
  static constexpr int tile_cells = 25;

  explicit Terrain(double cell_size) : cell_size_(cell_size) {}
  Mesh tile(int tile_x, int tile_y) const;
  double height(double x, double y) const;
  double halfWidth() const { return 0.5 * cell_size_ * tiles_x * tile_cells; }
  double halfLength() const { return 0.5 * cell_size_ * tiles_y * tile_cells; }

 private:
  double cell_size_;
};

}  // namespace pile

#endif
