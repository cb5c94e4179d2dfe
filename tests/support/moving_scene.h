// A crowd of everything that moves in every way and changes in every way, most of them without a
// word to the space.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "configurations.h"
#include "random.h"
#include "recorder.h"

namespace sap_test {

class MovingScene {
 public:
  struct Kinds {
    double offset = 0;  // of all, along x
    bool wild = true;   // AABBTest functions, and bounds that are infinite or no numbers
    bool all = true;    // any class of ODE
  };
  // Two planes, boxes, spheres, bars, user boxes, any class, sub-spaces. Most have bodies.
  MovingScene(const Configuration& configuration, std::size_t n, std::uint64_t seed, Kinds kinds);
  MovingScene(const Configuration& configuration, std::size_t n, std::uint64_t seed)
      : MovingScene(configuration, n, seed, Kinds()) {}
  ~MovingScene();
  MovingScene(const MovingScene&) = delete;
  MovingScene& operator=(const MovingScene&) = delete;

  dSpaceID space() const { return space_; }
  // The space's geoms in the order of adding, with ascending numbers.
  const std::vector<dGeomID>& order() const { return order_; }
  // Those in its sub-spaces. They have numbers, too.
  const std::vector<dGeomID>& inside() const { return inside_; }
  // "" or what is wrong about the pairs of the frame, by the rules that are set.
  std::string wrong(const Pairs& pairs) const;

  // About this part of the geoms moves a little way, some of them anywhere.
  void moveSome(double part);
  // Each in a direction of its own, but a tenth that stands; some turn.
  void drift(double distance);
  void turnBack() { sense_ = -sense_; }
  // Each anywhere within a distance.
  void tremble(double distance);
  // One of the things that programs do between frames.
  void edit();
  // From now on the space is told of what changes without a word.
  void promise();

 private:
  static constexpr std::size_t kPlanes = 2;

  dGeomID any();
  unsigned long anyBits();
  void add(dGeomID geom);
  void addAny();
  void addSubSpace();
  void addInside(dSpaceID space);
  dGeomID make();
  void place(dGeomID geom);
  void shift(dGeomID geom, double dx, double dy, double dz);
  void shift(dGeomID geom, double distance);
  void setBody(dGeomID geom, dBodyID body);
  void resize(dGeomID geom);
  void makeIll(dGeomID geom);
  void editInside();
  void destroy(dGeomID geom);
  dGeomID replace(dGeomID geom);
  dGeomID leaveOrReturn(dGeomID geom);
  void tell(dGeomID geom);

  const Space space_;
  const dWorldID world_ = dWorldCreate();
  Random random_;
  const std::uint64_t seed_;
  const Kinds kinds_;
  const std::size_t most_;
  const double reach_;
  double sense_ = 1;
  std::vector<dGeomID> order_, inside_;  // inside_: in sub-spaces
  std::size_t next_ = 0;
  dGeomID outside_ = nullptr, ill_ = nullptr;
  dReal was_ = 0;
  bool telling_ = false;
};

}  // namespace sap_test
