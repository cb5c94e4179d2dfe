// Unit cubes in a space, each with a place of its own around which it moves.
#pragma once

#include <ode/ode.h>

#include <vector>

#include "random.h"
#include "scenes.h"

namespace bench {

class MovingCubes {
 public:
  // Takes the space over.
  explicit MovingCubes(dSpaceID space) : space_(space), world_(dWorldCreate()) {}
  ~MovingCubes() {
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }
  MovingCubes(const MovingCubes&) = delete;
  MovingCubes& operator=(const MovingCubes&) = delete;

  // Adds a cube at the centre of `box`, on a body of its own if so wished.
  dGeomID add(const sap_test::Box& box, bool on_body) {
    const dGeomID geom = dCreateBox(space_, 1, 1, 1);
    if (on_body) dGeomSetBody(geom, dBodyCreate(world_));
    geoms_.push_back(geom);
    for (int axis = 0; axis < 3; ++axis)
      places_.push_back(static_cast<dReal>((box.low[axis] + box.high[axis]) / 2));
    const dReal* const at = &places_[places_.size() - 3];
    dGeomSetPosition(geom, at[0], at[1], at[2]);
    return geom;
  }
  // Puts a cube at a random place, on each axis up to `reach` from its own.
  void move(std::size_t cube, double reach) {
    dReal at[3];
    for (std::size_t axis = 0; axis < 3; ++axis)
      at[axis] = places_[3 * cube + axis] + static_cast<dReal>(random_.between(-reach, reach));
    dGeomSetPosition(geoms_[cube], at[0], at[1], at[2]);
  }
  std::size_t any() { return random_.below(geoms_.size()); }

  std::size_t size() const { return geoms_.size(); }
  dSpaceID space() const { return space_; }

 private:
  dSpaceID space_;
  dWorldID world_;
  std::vector<dGeomID> geoms_;
  std::vector<dReal> places_;
  sap_test::Random random_{3};
};

}  // namespace bench
