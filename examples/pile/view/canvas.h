#ifndef PILE_CANVAS_H
#define PILE_CANVAS_H

#include <array>
#include <memory>

#include "../simulation.h"
#include "../world.h"
#include "camera.h"

namespace pile {

// What to draw besides ground and bodies.
struct Layers {
  bool boxes = false;  // the bodies' AABBs
  bool contacts = false;
};

// Draws a world in drawstuff's, which ends at 100 units: all lengths are scaled, and the lowest
// point of the ground is put where drawstuff has its own. To be used by one thread, within
// drawstuff's loop.
class Canvas {
 public:
  // Lengths are scaled for this camera, which the ground then surrounds up to the horizon.
  Canvas(const World& world, const Camera& camera);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  void aim(const Camera& camera) const;
  void draw(const Simulation& simulation, const Layers& layers);

 private:
  class MeshLists;

  std::array<float, 3> place(const dReal* point) const;
  void drawGeom(dGeomID geom);
  void drawBox(dGeomID geom) const;
  void drawContact(const dContactGeom& contact) const;

  const World& world_;
  float scale_;
  float floor_;  // the height of drawstuff's ground
  std::unique_ptr<MeshLists> meshes_;
};

// Whether drawstuff's flat ground, and so its shadows, is where the scene's ground is.
bool hasFlatGround(const World& world);

}  // namespace pile

#endif
