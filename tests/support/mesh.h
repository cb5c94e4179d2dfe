// Meshes of a few triangles.
#pragma once

#include <ode/ode.h>

#include <utility>
#include <vector>

namespace sap_test {

// Three numbers a vertex, three vertices a triangle. It outlives its geoms.
class Mesh {
 public:
  Mesh(std::vector<float> vertices, std::vector<dTriIndex> triangles)
      : vertices_(std::move(vertices)), triangles_(std::move(triangles)) {
    dGeomTriMeshDataBuildSingle(data_, vertices_.data(), 3 * sizeof(float),
                                static_cast<int>(vertices_.size() / 3), triangles_.data(),
                                static_cast<int>(triangles_.size()), 3 * sizeof(dTriIndex));
  }
  ~Mesh() { dGeomTriMeshDataDestroy(data_); }
  Mesh(const Mesh&) = delete;
  Mesh& operator=(const Mesh&) = delete;

  dTriMeshDataID data() const { return data_; }
  dGeomID create(dSpaceID space) const {
    return dCreateTriMesh(space, data_, nullptr, nullptr, nullptr);
  }

 private:
  const std::vector<float> vertices_;
  const std::vector<dTriIndex> triangles_;
  const dTriMeshDataID data_ = dGeomTriMeshDataCreate();
};

// Around this place, up to so far along each axis.
inline Mesh tetrahedron(float x = 0, float z = 0, float r = 1) {
  return Mesh({x - r, -r, z - r, x + r, -r, z - r, x, r, z - r, x, 0, z + r},
              {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3});
}

}  // namespace sap_test
