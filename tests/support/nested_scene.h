// A space whose sub-spaces are large enough for trees of their own, and change.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "configurations.h"
#include "random.h"
#include "recorder.h"
#include "scenes.h"

namespace sap_test {

class NestedScene {
 public:
  explicit NestedScene(std::uint64_t seed) : random_(seed) {
    for (const std::size_t n : {150, 400, 300, 200, 100}) {
      const dSpaceID space = n == 200 ? dHashSpaceCreate(space_) : dParallelSAPSpaceCreate(space_);
      world_.take(asGeom(space));
      spaces_.push_back(space);
      if (n == 300) spaces_.push_back(dParallelSAPSpaceCreate(space));  // has one in it
      for (std::size_t i = 0; i < n; ++i) {
        // The first has none but those whose hits have bounds.
        const Shape& shape = shapes()[random_.below(n == 150 ? 4 : shapes().size())];
        if (shape.placeable) add(shape.create(random_.chance(0.1) ? spaces_.back() : space));
      }
    }
    world_.addBoxes(denseCube(random_.chance(0.5) ? 20 : 200, seed));
  }

  // Some geoms move, or all; change their bits, states and bodies; leave and come to other spaces.
  void change() {
    const double part = random_.chance(0.2) ? 1 : 0.03;
    for (dGeomID& geom : inside_) {
      if (random_.chance(part)) place(geom);
      if (random_.chance(0.02)) dGeomSetCategoryBits(geom, random_.below(16));
      if (random_.chance(0.02)) random_.chance(0.5) ? dGeomDisable(geom) : dGeomEnable(geom);
      if (random_.chance(0.02)) {
        dSpaceRemove(dGeomGetSpace(geom), geom);
        dSpaceAdd(spaces_[random_.below(spaces_.size())], geom);
      }
    }
    if (random_.chance(0.2)) std::swap(inside_[random_.below(inside_.size())], inside_.back());
    if (random_.chance(0.2)) {
      dGeomDestroy(inside_.back());
      inside_.pop_back();
    }
    for (const dSpaceID space : spaces_) {
      dGeomSetCategoryBits(asGeom(space), random_.chance(0.1) ? 1 : ~0ul);
      random_.chance(0.1) ? dGeomDisable(asGeom(space)) : dGeomEnable(asGeom(space));
    }
    if (random_.chance(0.1))
      dParallelSAPSpaceSetSweptBounds(spaces_[0], static_cast<dReal>(random_.between(0, 0.5)));
  }

  dSpaceID space() const { return space_; }
  const std::vector<dGeomID>& geoms() const { return world_.geoms(); }
  const std::vector<dGeomID>& inside() const { return inside_; }

 private:
  void add(dGeomID geom) {
    inside_.push_back(geom);
    if (random_.chance(0.2) && dGeomGetClass(geom) < dRayClass) {
      const std::vector<dBodyID>& bodies = world_.bodies();
      if (bodies.empty() || random_.chance(0.3))
        world_.giveBody(geom);
      else
        dGeomSetBody(geom, bodies[random_.below(bodies.size())]);
    }
    place(geom);
  }
  void place(dGeomID geom) {
    dGeomSetPosition(geom, static_cast<dReal>(random_.between(0, 12)),
                     static_cast<dReal>(random_.between(0, 12)),
                     static_cast<dReal>(random_.between(0, 6)));
    if (const dBodyID body = dGeomGetBody(geom)) dBodySetLinearVel(body, 3, 1, 0);
  }

  Random random_;
  const Space space_;
  World world_{space_};
  std::vector<dSpaceID> spaces_;
  std::vector<dGeomID> inside_;
};

}  // namespace sap_test
