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

}  // namespace sap_test
