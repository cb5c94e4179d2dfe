// Boxes of meshes: of a made cloth, and of real ones where there are such data.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdlib>

#include "bench/mesh_data.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

Bounds boundsOf(const bench::MeshBox& box) {
  Bounds bounds;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bounds[2 * axis] = real(box.lower[axis]);
    bounds[2 * axis + 1] = real(box.upper[axis]);
  }
  return bounds;
}

std::size_t countOf(dSpaceID space) {
  std::size_t pairs = 0;
  dSpaceCollide(space, &pairs,
                [](void* pairs, dGeomID, dGeomID) { ++*static_cast<std::size_t*>(pairs); });
  return pairs;
}

// Pairs within `a`, or of a box of each.
std::size_t pairsOf(const bench::MeshBoxes& a, const bench::MeshBoxes* b, int threads) {
  const Space space;
  dParallelSAPSpaceSetNumThreads(space, threads);
  for (const bench::MeshBoxes* boxes : {&a, b}) {
    if (!boxes) break;
    for (const bench::MeshBox& box : *boxes) {
      const dGeomID geom = createUserBoxWithoutTest(space, boundsOf(box));
      if (!b) continue;
      dGeomSetCategoryBits(geom, boxes == b ? 1 : 2);
      dGeomSetCollideBits(geom, boxes == b ? 2 : 1);
    }
  }
  return countOf(space);
}

}  // namespace

TEST_CASE("The pairs of a cloth in folds are those of a plain sweep", "[meshes]") {
  const bench::Mesh mesh = bench::madeCloth(40);
  REQUIRE(mesh.vertices.size() == 1600);
  REQUIRE(mesh.faces.size() == 2 * 39 * 39);
  const std::size_t edge_edge = bench::countPairs(mesh.edges, nullptr),
                    vertex_face = bench::countPairs(mesh.vertices, &mesh.faces);
  CHECK(edge_edge > 15 * mesh.edges.size());  // neighbours alone are about 10
  CHECK(vertex_face > 10 * mesh.vertices.size());
  for (const int threads : {1, 3}) {
    CHECK(pairsOf(mesh.edges, nullptr, threads) == edge_edge);
    CHECK(pairsOf(mesh.vertices, &mesh.faces, threads) == vertex_face);
  }
}

// Without data the CTest test meshes.data, which is this case alone, is shown as skipped.
TEST_CASE("Real meshes have as many pairs as are known", "[meshes-data]") {
  const char* const directory = std::getenv("ODE_PARALLEL_SAP_MESHES");
  if (!directory) return;
  std::size_t known_meshes = 0;
  for (const bench::Mesh& mesh : bench::readMeshes(directory)) {
    const bench::KnownPairs* const known = bench::knownPairsOf(mesh.name);
    if (!known) continue;
    ++known_meshes;
    INFO(mesh.name);
    CHECK(bench::countPairs(mesh.edges, nullptr) == known->edge_edge);
    CHECK(bench::countPairs(mesh.vertices, &mesh.faces) == known->vertex_face);
    if (sizeof(dReal) < sizeof(double)) continue;  // rounded bounds are others
    for (const int threads : {1, 2}) {
      CHECK(pairsOf(mesh.edges, nullptr, threads) == known->edge_edge);
      CHECK(pairsOf(mesh.vertices, &mesh.faces, threads) == known->vertex_face);
    }
  }
  CHECK(known_meshes > 0);
}
