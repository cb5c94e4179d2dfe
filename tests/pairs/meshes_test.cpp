// Boxes of real meshes: how they are read, and their pairs where there are such data.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>

#include "bench/mesh_data.h"
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/recorder.h"
#include "support/trace_files.h"
#include "support/user_box.h"

using namespace sap_test;

namespace {

template <class T>
void append(std::string& bytes, T number, bool big_endian) {
  char own[sizeof number];
  std::memcpy(own, &number, sizeof number);
  for (std::size_t i = 0; i < sizeof number; ++i)
    bytes +=
        own[big_endian == (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__) ? i : sizeof number - 1 - i];
}

void write(const std::string& path, const std::string& bytes) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

// Two triangles on a square that is as high as is said; floats and a colour where `big_endian`.
std::string squareAt(double height, bool big_endian) {
  std::string ply = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                    "_endian 1.0\ncomment by a test\nelement vertex 4\n";
  const std::string type = big_endian ? "float" : "double";
  if (big_endian) ply += "property uchar red\n";
  for (const char* axis : {"x", "y", "z"}) ply += "property " + type + " " + axis + "\n";
  ply += "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  for (int vertex = 0; vertex < 4; ++vertex) {
    if (big_endian) ply += 'r';
    for (const double x : {vertex % 2 * 1.0, vertex / 2 * 2.0, height})
      big_endian ? append(ply, static_cast<float>(x), true) : append(ply, x, false);
  }
  for (const int first : {0, 1}) {
    ply += '\3';
    for (const int vertex : {first, first + 1, first + 2})
      append(ply, std::int32_t{vertex}, big_endian);
  }
  return ply;
}

bool isMovedOutward(const bench::MeshBox& box, const double (&lower)[3], const double (&upper)[3]) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  bool is = true;
  for (std::size_t axis = 0; axis < 3; ++axis)
    is = is && box.lower[axis] == std::nextafter(lower[axis], -infinity) &&
         box.upper[axis] == std::nextafter(upper[axis], infinity);
  return is;
}

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

TEST_CASE("The boxes of a mesh between two frames hold both, a double further out", "[meshes]") {
  for (const bool big_endian : {false, true}) {
    const Folder folder;
    write(folder / "square/frames/part07.ply", squareAt(0.5, big_endian));
    write(folder / "square/frames/part08.ply", squareAt(-1, big_endian));
    const std::vector<bench::Mesh> meshes = bench::readMeshes(folder / "");
    REQUIRE(meshes.size() == 1);
    const bench::Mesh& mesh = meshes[0];
    CHECK(mesh.name == "square-07");
    REQUIRE(mesh.vertices.size() == 4);
    CHECK(isMovedOutward(mesh.vertices[3], {1, 2, -1}, {1, 2, 0.5}));
    REQUIRE(mesh.edges.size() == 5);  // one is of both faces
    CHECK(isMovedOutward(mesh.edges[0], {0, 0, -1}, {1, 0, 0.5}));
    REQUIRE(mesh.faces.size() == 2);
    CHECK(isMovedOutward(mesh.faces[1], {0, 0, -1}, {1, 2, 0.5}));
    CHECK(bench::countPairs(mesh.edges, nullptr) == 8);  // two are opposite, two times
    CHECK(bench::countPairs(mesh.vertices, &mesh.faces) == 8);
    CHECK(pairsOf(mesh.edges, nullptr, 1) == 8);
    CHECK(pairsOf(mesh.vertices, &mesh.faces, 1) == 8);
  }
}

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

TEST_CASE("Boxes in files of doubles are read as they are", "[meshes]") {
  const Folder folder;
  const double numbers[] = {-1, 2, 3e-300, 4, 5.5, 6};
  for (const char* kind : {"vertices", "edges", "faces"}) {
    std::string bytes;
    for (const double number : numbers) append(bytes, number, false);
    write(folder / ("cloth-2-" + std::string(kind) + ".f64"), bytes);
  }
  const std::vector<bench::Mesh> meshes = bench::readMeshes(folder / "");
  REQUIRE(meshes.size() == 1);
  CHECK(meshes[0].name == "cloth-2");
  for (const auto* boxes : {&meshes[0].vertices, &meshes[0].edges, &meshes[0].faces}) {
    REQUIRE(boxes->size() == 1);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      CHECK((*boxes)[0].lower[axis] == numbers[axis]);
      CHECK((*boxes)[0].upper[axis] == numbers[3 + axis]);
    }
  }
}

TEST_CASE("Files that are no meshes are refused", "[meshes]") {
  const Folder folder;
  CHECK_THROWS_AS(bench::readMeshes(folder / ""), std::runtime_error);
  const std::string whole = squareAt(0, false);
  const std::string path = folder / "mesh.ply";
  const std::string others[] = {
      whole.substr(0, whole.size() - 1),              // ends too early
      "ply\nformat ascii 1.0\nend_header\n",          // text
      "solid\n",                                      // something else
      whole.substr(0, whole.size() - 4) + "\4\1\1\1"  // a vertex that is none
  };
  for (const std::string& bytes : others) {
    write(path, bytes);
    CHECK_THROWS_AS(bench::meshBetween("mesh", path, path), std::runtime_error);
  }
  write(path, whole);
  CHECK_NOTHROW(bench::meshBetween("mesh", path, path));
  write(folder / "cloth-vertices.f64", std::string(47, 'x'));
  CHECK_THROWS_AS(bench::readMeshes(folder / ""), std::runtime_error);
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
