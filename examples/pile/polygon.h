#ifndef PILE_POLYGON_H
#define PILE_POLYGON_H

#include <array>
#include <vector>

namespace pile {

struct Point2 {
  double x;
  double y;
};
using Loop = std::vector<Point2>;

// A region of the plane: the first loop is its counter-clockwise outline, each further one a hole,
// clockwise.
using Region = std::vector<Loop>;

// A counter-clockwise triangle of indices into the region's points, loop after loop.
using IndexTriangle = std::array<int, 3>;

// Cuts the region into triangles that use every point: with n points and h holes, n + 2h - 2 of
// them. Throws std::logic_error if the region is not what is said above (a loop that crosses itself
// or another, a hole outside).
std::vector<IndexTriangle> triangulate(const Region& region);

}  // namespace pile

#endif
