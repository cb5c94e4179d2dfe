// Boxes of the vertices, edges and faces of meshes that move: real data, read from a directory that
// the user names.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace bench {

struct MeshBox {
  double lower[3], upper[3];
};
using MeshBoxes = std::vector<MeshBox>;

// A mesh on its way from one frame to the next.
struct Mesh {
  std::string name;
  MeshBoxes vertices, edges, faces;
};

// All meshes of a directory, by name: <name>-vertices.f64, -edges.f64 and -faces.f64, boxes of six
// little-endian doubles each, lower x y z and upper x y z (ply_boxes.py makes them of frames in
// PLY). Throws std::runtime_error where a file is not as it should be or where there is no mesh.
std::vector<Mesh> readMeshes(const std::string& directory);

// A cloth of side x side vertices in folds that touch, moving: made by a formula, for where there
// are no data.
Mesh madeCloth(std::size_t side);

// Pairs that overlap as closed intervals, adjacent ones included, as far as they are known.
struct KnownPairs {
  const char* mesh;
  std::size_t edge_edge, vertex_face;
};
// Null where they are not.
const KnownPairs* knownPairsOf(const std::string& mesh);

// Counted by a plain sweep along x, which shares no code with what is compared. The pairs within
// `a` where `b` is null.
std::size_t countPairs(const MeshBoxes& a, const MeshBoxes* b);

}  // namespace bench
