#include "moving_cubes.h"

namespace bench {

MovingCubes::~MovingCubes() {
  dSpaceDestroy(space_);
  dWorldDestroy(world_);
}

dGeomID MovingCubes::add(const sap_test::Box& box, bool on_body) {
  const dGeomID geom = dCreateBox(space_, 1, 1, 1);
  if (on_body) dGeomSetBody(geom, dBodyCreate(world_));
  geoms_.push_back(geom);
  for (int axis = 0; axis < 3; ++axis)
    places_.push_back(static_cast<dReal>((box.low[axis] + box.high[axis]) / 2));
  const dReal* const at = &places_[places_.size() - 3];
  dGeomSetPosition(geom, at[0], at[1], at[2]);
  return geom;
}

void MovingCubes::move(std::size_t cube, double reach) {
  dReal at[3];
  for (std::size_t axis = 0; axis < 3; ++axis)
    at[axis] = places_[3 * cube + axis] + static_cast<dReal>(random_.between(-reach, reach));
  dGeomSetPosition(geoms_[cube], at[0], at[1], at[2]);
}

}  // namespace bench
