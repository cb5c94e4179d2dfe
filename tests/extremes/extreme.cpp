#include "extreme.h"

#include <cmath>

namespace sap_test {

double Scene::side() const {
  return 0.95 * std::cbrt(static_cast<double>(size));
}

void Scene::addUnitBoxes(std::size_t n) {
  while (n-- > 0) placeAnywhere(take(dCreateBox(space(), 1, 1, 1)));
}

void Scene::placeAnywhere(dGeomID geom) {
  const dReal x = between(0, side()), y = between(0, side()), z = between(0, side());
  place(geom, x, y, z);
}

Play onUnitBoxes(Play change) {
  return [change](Scene& scene, int frame) {
    if (frame == 0) scene.addUnitBoxes(scene.size);
    change(scene, frame);
  };
}

Play eachUnitBox(std::function<void(Scene& scene, dGeomID geom, int frame)> change) {
  return onUnitBoxes([change](Scene& scene, int frame) {
    for (const dGeomID geom : scene.geoms()) change(scene, geom, frame);
  });
}

}  // namespace sap_test
