// Scenes: the same seed gives the same scene everywhere.
//
// A scene is first of all a list of boxes, of use to anything that finds overlapping boxes. Most
// tests want them as geoms of a space, together with scenes that need more than boxes.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace sap_test {

struct Box {
  double low[3], high[3];
};
using Boxes = std::vector<Box>;

// Every generator makes exactly n boxes, in an order that says nothing about where they are.
Boxes denseCube(std::size_t n, std::uint64_t seed);     // unit cubes, about 4.5 pairs each
Boxes flatLayer(std::size_t n, std::uint64_t seed);     // one layer in x and y
Boxes straightLine(std::size_t n, std::uint64_t seed);  // all along x
Boxes clusters(std::size_t n, std::uint64_t seed);      // Gaussian, about 200 boxes in each
Boxes twoDecades(std::size_t n, std::uint64_t seed);    // log-uniform sizes
Boxes sixDecades(std::size_t n, std::uint64_t seed);
Boxes giantAmongDust(std::size_t n, std::uint64_t seed);   // one box touches all others
Boxes touchingLattice(std::size_t n, std::uint64_t seed);  // faces, edges, corners in common
Boxes onePlace(std::size_t n, std::uint64_t seed);         // all the same: quadratic
Boxes longBars(std::size_t n, std::uint64_t seed);         // thin, along each of the axes
Boxes farClusters(std::size_t n, std::uint64_t seed);      // two dense cubes a million apart
Boxes heap(std::size_t n, std::uint64_t seed);             // a cone of unit cubes at rest

// So far along each axis.
void moveBy(dGeomID geom, double x, double y, double z);

// Numbers of geoms at which a space does its work in different ways.
constexpr std::size_t kSceneSizes[] = {8, 200, 3000};

struct BoxScene {
  const char* name;
  Boxes (*make)(std::size_t n, std::uint64_t seed);
};
const std::vector<BoxScene>& boxScenes();

// A space's geoms in the order in which they were added, numbered 0, 1, 2... in that order, and
// the bodies some of them are on. Destroys what is left of them in its destructor, the space
// apart, so destroy a World before its space or let the space clean up nothing.
class World {
 public:
  explicit World(dSpaceID space, const Boxes& boxes = {});
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  dSpaceID space() const { return space_; }
  dWorldID dynamics() const { return dynamics_; }
  const std::vector<dGeomID>& geoms() const { return geoms_; }
  const std::vector<dBodyID>& bodies() const { return bodies_; }

  // Takes over a geom that was just created in the space, or is in none and is now added.
  dGeomID take(dGeomID geom);
  dGeomID addBox(const Box& box);
  void addBoxes(const Boxes& boxes);
  // Takes a geom out of its space and lets go of it; addAgain() makes it the last one.
  void remove(dGeomID geom);
  void addAgain(dGeomID geom);
  // Destroys the last ones.
  void shrinkTo(std::size_t geoms);
  // The body takes the geom's place and carries it from now on.
  dBodyID giveBody(dGeomID geom);

  // Puts every geom that has a place somewhere near it.
  void jitter(double distance, std::uint64_t seed);

 private:
  dSpaceID space_;
  dWorldID dynamics_;
  std::vector<dGeomID> geoms_;
  std::vector<dBodyID> bodies_;
};

struct WorldScene {
  std::string name;
  std::size_t most;  // geoms up to which the scene is sensible: quadratic output
  std::function<void(World& world, std::size_t n, std::uint64_t seed)> populate;
};
// Every box scene as dBox geoms, and planes, walls, spheres, geoms that share bodies, mixed bits
// and a mixture of all of ODE's classes.
const std::vector<WorldScene>& worldScenes();

// ODE's own spaces: two that hash or test all, and two that sort.
struct StockSpace {
  const char* name;
  dSpaceID (*create)(dSpaceID parent);
};
extern const StockSpace kStockSpaces[4];

// One geom of each class that ODE has, about a unit large, at the origin.
struct Shape {
  const char* name;
  dGeomID (*create)(dSpaceID space);
  bool placeable;
};
const std::vector<Shape>& shapes();
// A dGeomTransform that carries a geom and destroys it.
dGeomID createTransform(dSpaceID space, dGeomID carried);
// Frees the meshes and height fields that the shapes share; before dCloseODE.
void releaseShapes();

}  // namespace sap_test
