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
  ~MovingCubes();
  MovingCubes(const MovingCubes&) = delete;
  MovingCubes& operator=(const MovingCubes&) = delete;

  // Adds a cube at the centre of `box`, on a body of its own if so wished.
  dGeomID add(const sap_test::Box& box, bool on_body);
  // Puts a cube at a random place, on each axis up to `reach` from its own.
  void move(std::size_t cube, double reach);
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
