// A yard, and what a program can do so that only what it requires is found and collided.
#ifndef SCENE_YARD_H
#define SCENE_YARD_H

#include <ode/ode.h>

#include <cstddef>
#include <vector>

namespace scene {

// What is done to spare pairs. All of it off: one space, every pair judged by the callback, all
// bodies awake, and the whole world stepped as often as the fastest bodies need.
struct Measures {
  bool layers = false;    // categories say who meets whom
  bool apart = false;     // what never moves is in a space of its own
  bool asleep = false;    // bodies at rest sleep, and their pairs are not found
  bool substeps = false;  // only the fast bodies are stepped more often than once a frame
  bool proxies = false;   // what is far away is one geom instead of twelve
  bool tunnel = false;  // nothing is stepped more often, for comparison: bullets fly through walls
};

// What a frame did.
struct Work {
  std::size_t pairs = 0;     // calls of the near callback
  std::size_t contacts = 0;  // joints
  double ms = 0;             // of the frame, wall clock
};

// 1,600 tiles and a wall, which never move; stacks of crates; logs of twelve spheres each; dust,
// which meets the ground only; bullets, shot at the wall.
class Yard {
 public:
  explicit Yard(const Measures& measures, double size);
  ~Yard();
  Yard(const Yard&) = delete;
  Yard& operator=(const Yard&) = delete;

  // Frames of 10 ms in which what was put on the ground comes to rest.
  void settle(int frames);
  void shoot();
  Work frame();

  // Of the bullets, those that are behind the wall.
  int behindWall() const;

 private:
  struct Log {
    dBodyID body;
    dGeomID proxy;
    std::vector<dGeomID> parts;
  };

  void addGround(int tiles);
  void addCrates(int stacks);
  void addLogs(int columns);
  void addDust(int grains);
  void addBullets(int count);
  dBodyID addBody(dWorldID world, dReal x, dReal y, dReal z, dReal kg);
  void mark(dGeomID geom, unsigned long layer);

  static void near(void* yard, dGeomID a, dGeomID b);
  static void nearFast(void* yard, dGeomID a, dGeomID b);
  void collide();
  void step(dReal dt);
  void stepFast(dReal dt);
  void chooseProxies();

  const Measures measures_;
  dWorldID world_, fast_world_;             // the same unless the fast bodies are stepped apart
  dSpaceID bodies_, ground_, fast_bodies_;  // the same unless they are apart
  dJointGroupID joints_;
  std::vector<Log> logs_;
  std::vector<dBodyID> bullets_;
  Work work_;
};

}  // namespace scene

#endif
