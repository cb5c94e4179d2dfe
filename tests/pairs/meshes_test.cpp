// Boxes of the vertices, edges and faces of a cloth in folds that touch, each around its motion
// from one frame to the next.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/oracle.h"
#include "support/recorder.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

constexpr std::size_t side = 30;  // vertices

// Where a vertex is at a time: as wide as it has vertices, in waves of which four lie on one
// another.
Bounds placeOf(std::size_t vertex, double time) {
  const double x = static_cast<double>(vertex % side), y = static_cast<double>(vertex / side);
  const double fold = 40 * x / static_cast<double>(side) + time;
  const dReal at[3] = {real(x / 8 + 2 * std::sin(fold)), real(y + std::sin(y + 3 * time)),
                       real(3 * std::cos(fold) + 0.5 * std::sin(0.3 * y + time))};
  return {at[0], at[0], at[1], at[1], at[2], at[2]};
}

using Corners = std::set<std::size_t>;

Bounds boundsOfMotion(const Corners& corners) {
  Bounds bounds = placeOf(*corners.begin(), 0);
  for (const std::size_t corner : corners)
    for (const double time : {0.0, 0.1}) {
      const Bounds place = placeOf(corner, time);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        bounds[2 * axis] = std::min(bounds[2 * axis], place[2 * axis]);
        bounds[2 * axis + 1] = std::max(bounds[2 * axis + 1], place[2 * axis]);
      }
    }
  return bounds;
}

std::set<Corners> facesOfCloth() {
  std::set<Corners> faces;
  for (std::size_t row = 0; row + 1 < side; ++row)
    for (std::size_t column = 0; column + 1 < side; ++column) {
      const std::size_t at = row * side + column;
      faces.insert({at, at + 1, at + side});
      faces.insert({at + 1, at + side + 1, at + side});
    }
  return faces;
}

std::set<Corners> edgesOfCloth() {
  std::set<Corners> edges;
  for (const Corners& face : facesOfCloth())
    for (const std::size_t left_out : face) {
      Corners edge = face;
      edge.erase(left_out);
      edges.insert(edge);
    }
  return edges;
}

std::set<Corners> verticesOfCloth() {
  std::set<Corners> vertices;
  for (std::size_t vertex = 0; vertex < side * side; ++vertex) vertices.insert({vertex});
  return vertices;
}

// Pairs within `some`, or of a box of each; as many as `least` for each of `some`.
void checkPairs(const std::set<Corners>& some, const std::set<Corners>& others, std::size_t least) {
  Pairs expected;
  for (const int threads : {1, 3}) {
    const Space space;
    dParallelSAPSpaceSetNumThreads(space, threads);
    std::vector<dGeomID> geoms;
    for (const auto* part : {&some, &others})
      for (const Corners& corners : *part) {
        const dGeomID geom = createUserBoxWithoutTest(space, boundsOfMotion(corners));
        setNumber(geom, geoms.size());
        geoms.push_back(geom);
        if (others.empty()) continue;
        dGeomSetCategoryBits(geom, part == &some ? 1 : 2);
        dGeomSetCollideBits(geom, part == &some ? 2 : 1);
      }
    const Pairs found = collide(space);
    if (expected.empty()) expected = expectedPairs(geoms);
    CHECK(expected.size() > least * some.size());
    CHECK(difference(found, expected) == "");
  }
}

}  // namespace

TEST_CASE("The pairs of a cloth in folds are all found", "[meshes]") {
  checkPairs(edgesOfCloth(), {}, 10);  // neighbours alone are about 10
  checkPairs(verticesOfCloth(), facesOfCloth(), 8);
}
