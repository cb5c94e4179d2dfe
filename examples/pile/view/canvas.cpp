#include "canvas.h"

#include <GL/gl.h>
#include <drawstuff/drawstuff.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace pile {
namespace {

// In drawstuff's units. Its ground ends at 100: seen from as low as this, next to where the sky
// begins.
constexpr float camera_height = 2;
constexpr float ground_gap =
    0.03F;  // between its ground and the scene's, so that neither shows through the other
constexpr float contact_size = 0.01F;

struct Colour {
  float red, green, blue;
  float alpha = 1;
};

// Told apart by hue alone, whatever the light does to them, from each other and from drawstuff's
// sky (blue over green over red) and ground (red and green over blue).
constexpr Colour ground_colour = {0.62F, 0.64F, 0.56F};
constexpr Colour awake_colour = {1.0F, 0.5F, 0.08F};
constexpr Colour asleep_colour = {0.45F, 0.3F, 0.85F};
constexpr Colour box_colour = {1, 0, 0, 0.2F};
constexpr Colour contact_colour = {0, 1, 0.4F};

void setColour(const Colour& colour) {
  dsSetTexture(DS_NONE);
  dsSetColorAlpha(colour.red, colour.green, colour.blue, colour.alpha);
}

std::array<float, 12> rotationOf(dGeomID geom) {
  std::array<float, 12> rotation;
  std::copy_n(dGeomGetRotation(geom), 12, rotation.begin());
  return rotation;
}

constexpr float unturned[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

}  // namespace

// OpenGL's display lists of the meshes, in each colour that they had so far.
class Canvas::MeshLists {
 public:
  MeshLists(const World& world, float scale) : world_(world), scale_(scale) {}
  ~MeshLists() {
    for (const auto& entry : lists_) glDeleteLists(entry.second, 1);
  }

  void draw(dGeomID geom, const Colour& colour, const std::array<float, 3>& place) {
    const std::array<float, 12> r = rotationOf(geom);
    const float matrix[16] = {r[0], r[4], r[8],  0, r[1],     r[5],     r[9],     0,
                              r[2], r[6], r[10], 0, place[0], place[1], place[2], 1};
    glMatrixMode(GL_MODELVIEW);
    glPushMatrix();
    glMultMatrixf(matrix);
    glCallList(listOf(geom, colour));
    glPopMatrix();
  }

 private:
  GLuint listOf(dGeomID geom, const Colour& colour) {
    const Mesh& mesh = world_.drawnMeshOf(geom);
    GLuint& list = lists_[{&mesh, &colour}];
    if (list == 0) list = compile(mesh, colour);
    return list;
  }

  GLuint compile(const Mesh& mesh, const Colour& colour) const {
    std::vector<float> corners;
    for (const Mesh::Triangle& triangle : mesh.triangles)
      for (const dTriIndex corner : triangle)
        for (const float coordinate : mesh.points[corner]) corners.push_back(scale_ * coordinate);
    const GLuint list = glGenLists(1);
    glNewList(list, GL_COMPILE);
    setColour(colour);
    constexpr float origin[3] = {0, 0, 0};
    dsDrawTriangles(origin, unturned, corners.data(), static_cast<int>(mesh.triangles.size()), 1);
    glEndList();
    return list;
  }

  const World& world_;
  const float scale_;
  std::map<std::pair<const Mesh*, const Colour*>, GLuint> lists_;
};

bool hasFlatGround(const World& world) {
  const auto& geoms = world.geoms();
  return std::any_of(geoms.begin(), geoms.end(),
                     [](dGeomID geom) { return dGeomGetClass(geom) == dPlaneClass; });
}

Canvas::Canvas(const World& world, const Camera& camera) : world_(world), scale_(1), floor_(0) {
  if (!hasFlatGround(world)) {
    dReal box[6];
    for (dGeomID geom : world.geoms()) {
      dGeomGetAABB(geom, box);
      floor_ = std::min(floor_, static_cast<float>(box[4]));
    }
  }
  const double height = std::max(camera.position[2] - floor_, world.body_size);
  scale_ = static_cast<float>(camera_height / height);
  if (!hasFlatGround(world)) floor_ -= ground_gap / scale_;
  meshes_ = std::make_unique<MeshLists>(world, scale_);
}

Canvas::~Canvas() = default;

std::array<float, 3> Canvas::place(const dReal* point) const {
  return {scale_ * static_cast<float>(point[0]), scale_ * static_cast<float>(point[1]),
          scale_ * (static_cast<float>(point[2]) - floor_)};
}

void Canvas::aim(const Camera& camera) const {
  const dReal position[] = {static_cast<dReal>(camera.position[0]),
                            static_cast<dReal>(camera.position[1]),
                            static_cast<dReal>(camera.position[2])};
  float angles[] = {static_cast<float>(camera.heading), static_cast<float>(camera.pitch), 0};
  dsSetViewpoint(place(position).data(), angles);
}

void Canvas::draw(const Simulation& simulation, const Layers& layers) {
  for (dGeomID geom : world_.geoms()) drawGeom(geom);
  if (layers.contacts) {
    glDisable(GL_DEPTH_TEST);  // they lie between the bodies
    for (const dContactGeom& contact : simulation.contacts()) drawContact(contact);
    glEnable(GL_DEPTH_TEST);
  }
  if (layers.boxes)
    for (dGeomID geom : world_.geoms())
      if (dGeomGetBody(geom)) drawBox(geom);
}

void Canvas::drawGeom(dGeomID geom) {
  const dBodyID body = dGeomGetBody(geom);
  const Colour& colour = !body                  ? ground_colour
                         : dBodyIsEnabled(body) ? awake_colour
                                                : asleep_colour;
  const int shape = dGeomGetClass(geom);
  if (shape == dPlaneClass) return;  // drawstuff's ground is there
  const std::array<float, 3> centre = place(dGeomGetPosition(geom));
  if (shape == dTriMeshClass) return meshes_->draw(geom, colour, centre);
  setColour(colour);
  if (shape == dSphereClass)
    return dsDrawSphere(centre.data(), rotationOf(geom).data(),
                        scale_ * static_cast<float>(dGeomSphereGetRadius(geom)));
  dVector3 lengths;
  dGeomBoxGetLengths(geom, lengths);
  const float sides[] = {scale_ * static_cast<float>(lengths[0]),
                         scale_ * static_cast<float>(lengths[1]),
                         scale_ * static_cast<float>(lengths[2])};
  dsDrawBox(centre.data(), rotationOf(geom).data(), sides);
}

void Canvas::drawBox(dGeomID geom) const {
  dReal box[6];
  dGeomGetAABB(geom, box);
  const dReal middle[] = {(box[0] + box[1]) / 2, (box[2] + box[3]) / 2, (box[4] + box[5]) / 2};
  float sides[3];
  for (int i = 0; i < 3; ++i) sides[i] = scale_ * static_cast<float>(box[2 * i + 1] - box[2 * i]);
  setColour(box_colour);
  dsDrawBox(place(middle).data(), unturned, sides);
}

void Canvas::drawContact(const dContactGeom& contact) const {
  const float sides[] = {contact_size, contact_size, contact_size};
  setColour(contact_colour);
  dsDrawBox(place(contact.pos).data(), unturned, sides);
}

}  // namespace pile
