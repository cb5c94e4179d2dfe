// A warehouse with robots that drive, scan and plan, in ODE's spaces and in the parallel space.
#ifndef SCENE_WAREHOUSE_H
#define SCENE_WAREHOUSE_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace scene {

// What a program does beyond the one line. None of it changes a result.
struct Ways {
  bool rays = false;         // dParallelSAPSpaceRays
  bool overlaps = false;     // dParallelSAPSpaceOverlaps
  bool contacts = false;     // dParallelSAPSpaceCollideContacts
  bool skip_static = false;  // pairs of static geoms are not reported,
  bool skip_asleep = false;  // nor those of sleeping bodies
  bool notified = false;     // dParallelSAPSpaceSetNotified
  bool layers = false;       // categories say that static geoms are no pairs
  bool apart = false;        // static geoms are in a sub-space, which never collides with itself
};

struct Plan {
  std::string space = "hash";  // simple, sap, parallel-sap
  int shelves = 3000;
  int threads = 0;  // of the parallel space
  Ways ways = {};
};

constexpr int robot_count = 20;
constexpr int ray_count = 360 * robot_count;
constexpr int probe_count = 50 * robot_count;

// What a frame did. Pairs and contacts of the stage "collide", rays that hit, poses that are free.
struct Work {
  enum { Collide, Lidar, Planner, Stages };
  std::array<double, Stages> ms = {};  // wall clock
  unsigned long long pairs = 0;        // calls of the near callback
  std::size_t contacts = 0, hits = 0, free = 0;

  double total() const { return ms[Collide] + ms[Lidar] + ms[Planner]; }
};

// What must not depend on the space. Pairs have a body that is awake.
struct Answers {
  std::vector<std::pair<int, int>> pairs, touching;  // numbers of geoms, ascending
  std::vector<dReal> distances;                      // of each ray; -1: it hits nothing
  std::vector<bool> free;                            // of each probe
};

// Shelves, which are boxes, and a floor with a ramp, which is a mesh, are static. 300 boxes sleep.
// Twenty robots of twelve geoms on one body, in a sub-space each, drive through the aisles.
class Warehouse {
 public:
  explicit Warehouse(const Plan& plan);
  virtual ~Warehouse();
  Warehouse(const Warehouse&) = delete;
  Warehouse& operator=(const Warehouse&) = delete;

  // The robots drive on, which is not timed. Then the three stages run.
  const Work& frame();
  // Of the last frame. Pairs that do not touch are known only without `Ways::contacts`.
  Answers answers();

  const std::vector<dGeomID>& geoms() const { return geoms_; }
  const std::vector<dParallelSAPRay>& rays() const { return rays_; }
  const std::vector<dParallelSAPRayHit>& hits() const { return hits_; }
  const std::vector<dParallelSAPProbe>& probes() const { return probes_; }

 protected:
  // The stages. Each may be done in another way, with the callbacks below.
  virtual void collide();
  virtual void castRays();
  virtual void tryPoses();

  static void near(void* warehouse, dGeomID a, dGeomID b);
  static void nearRay(void* warehouse, dGeomID a, dGeomID b);
  static void nearProbe(void* warehouse, dGeomID a, dGeomID b);
  // The geom of ray or probe i, which the callbacks then see.
  dGeomID aim(std::size_t i);
  dGeomID pose(std::size_t i);

 private:
  static void report(void* warehouse, dGeomID a, dGeomID b, const dContactGeom* contacts,
                     int count);
  dGeomID add(dGeomID geom, dReal x, dReal y, dReal z);
  dBodyID addBody(double x, double y, double z);
  void addShelves();
  void addFloor();
  void addBoxes();
  void addRobots();
  void driveOn();
  void placeProbes();

  const Plan plan_;
  const int columns_, rows_;  // of bays
  dWorldID world_;
  dSpaceID space_, static_;
  dTriMeshDataID floor_;
  std::vector<float> corners_;
  std::vector<dTriIndex> triangles_;
  std::vector<dGeomID> geoms_;  // by number
  std::vector<dBodyID> robots_;
  dGeomID ray_;
  std::vector<dParallelSAPRay> rays_;
  std::vector<dParallelSAPRayHit> hits_;
  std::vector<dParallelSAPProbe> probes_;
  std::size_t current_ = 0;  // ray or probe
  int frames_ = 0;
  Work work_;
  Answers answers_;
};

// Draws the last frame into a PNG file: rays up to their hits, and poses, the free ones in green.
// Only in builds with drawstuff. Throws std::runtime_error.
void draw(const Warehouse& warehouse, const std::string& file);

}  // namespace scene

#endif
