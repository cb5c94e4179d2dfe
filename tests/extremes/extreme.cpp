#include "extreme.h"

#include <cmath>

#include "../support/oracle.h"

namespace sap_test {

double Scene::side() const {
  return 0.95 * std::cbrt(static_cast<double>(size));
}

dGeomID Scene::addUnitBox() {
  const dGeomID geom = take(dCreateBox(space(), 1, 1, 1));
  placeAnywhere(geom);
  return geom;
}

void Scene::placeAnywhere(dGeomID geom) {
  const dReal x = between(0, side()), y = between(0, side()), z = between(0, side());
  place(geom, x, y, z);
}

const std::vector<Extreme>& extremes() {
  static const std::vector<Extreme> all = [] {
    std::vector<Extreme> joined;
    for (const auto part : {extremePlaces, extremeSizes, extremeBounds, extremeChanges,
                            extremeStructures, extremeCallers}) {
      for (const Extreme& extreme : part()) joined.push_back(extreme);
    }
    return joined;
  }();
  return all;
}

Pairs expectedPairs(const Scene& scene) {
  const FloatingPointMode mode(FloatingPointMode::kDefault);
  return expectedPairs(scene.geoms());
}

}  // namespace sap_test
