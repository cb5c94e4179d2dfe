// dParallelSAPSpaceRays: what the nearest hits of a batch of rays cost, beside a loop of
// dSpaceCollide2 with a callback that calls dCollide, in this space and in ODE's.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "csv.h"
#include "program.h"
#include "random.h"
#include "stopwatch.h"

namespace bench {
namespace {

using sap_test::Random;
using Rays = std::vector<dParallelSAPRay>;
using Hits = std::vector<dParallelSAPRayHit>;

struct Wishes {
  std::vector<std::string> spaces{"parallel-sap", "dHashSpace", "dSweepAndPruneSpace"};
  std::vector<std::string> kinds{"lidar", "pickers", "short"};
  std::vector<std::string> shapes{"mixed"};
  std::vector<std::size_t> sizes{1000, 10000, 100000};
  std::vector<std::size_t> rays{10000, 100000, 1000000};
  std::vector<int> threads{1, 0};
  std::vector<double> moving{0, 1};
  std::size_t sample = 500;  // rays of a loop in ODE's spaces
  int rounds = 5;
  CsvFile csv;
};

dSpaceID createSpace(const std::string& name) {
  if (name == "parallel-sap") return dParallelSAPSpaceCreate(nullptr);
  if (name == "dHashSpace") return dHashSpaceCreate(nullptr);
  if (name == "dSweepAndPruneSpace") return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
  if (name == "dSimpleSpace") return dSimpleSpaceCreate(nullptr);
  throw std::invalid_argument("no space " + name);
}

dReal real(double value) {
  return static_cast<dReal>(value);
}

constexpr double spacing = 4;  // of shapes about a unit large: a street, not a heap

// Shapes in a cube, turned anyhow.
class Scene {
 public:
  Scene(const std::string& space, const std::string& shapes, std::size_t n)
      : space_(createSpace(space)), side_(spacing * std::cbrt(static_cast<double>(n))) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t kind = shapes == "mixed" ? i % 4 : 0;
      const dGeomID geom = kind == 0   ? dCreateBox(space_, 1, 1, 1)
                           : kind == 1 ? dCreateSphere(space_, real(0.5))
                           : kind == 2 ? dCreateCapsule(space_, real(0.4), 1)
                                       : dCreateCylinder(space_, real(0.4), 1);
      dMatrix3 turned;
      dRFromEulerAngles(turned, real(random_.between(-3, 3)), real(random_.between(-3, 3)),
                        real(random_.between(-3, 3)));
      dGeomSetRotation(geom, turned);
      dGeomSetPosition(geom, real(random_.between(0, side_)), real(random_.between(0, side_)),
                       real(random_.between(0, side_)));
      geoms_.push_back(geom);
    }
  }
  ~Scene() { dSpaceDestroy(space_); }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  dSpaceID space() const { return space_; }
  double side() const { return side_; }

  void move(double part) {
    const std::size_t movers = static_cast<std::size_t>(part * static_cast<double>(geoms_.size()));
    for (std::size_t i = 0; i < movers; ++i) {
      const dReal* const at = dGeomGetPosition(geoms_[i]);
      dGeomSetPosition(geoms_[i], at[0] + real(random_.between(-0.1, 0.1)), at[1], at[2]);
    }
  }

 private:
  const dSpaceID space_;
  const double side_;
  Random random_{1};
  std::vector<dGeomID> geoms_;
};

// lidar: rings of 1,024 rays each from the middle, as long as half the scene; pickers: from
// anywhere to anywhere; short: anywhere, two shapes long.
Rays raysOf(const std::string& kind, std::size_t n, double side) {
  Random random(2);
  Rays rays;
  for (std::size_t i = 0; i < n; ++i) {
    dParallelSAPRay ray = {};
    ray.category_bits = ray.collide_bits = ~0ul;
    const double turn = 6.283185307179586 * static_cast<double>(i % 1024) / 1024;
    const double up =
        -0.4 + 0.8 * static_cast<double>(i / 1024) / static_cast<double>(n / 1024 + 1);
    for (int axis = 0; axis < 3; ++axis) {
      ray.origin[axis] = real(kind == "lidar" ? side / 2 : random.between(0, side));
      ray.direction[axis] = real(random.gauss());
    }
    if (kind == "lidar") {
      ray.direction[0] = real(std::cos(turn));
      ray.direction[1] = real(std::sin(turn));
      ray.direction[2] = real(up);
    }
    ray.length = real(kind == "short" ? 2 : kind == "lidar" ? side / 2 : side);
    rays.push_back(ray);
  }
  return rays;
}

void keepNearest(void* data, dGeomID o1, dGeomID o2) {
  dParallelSAPRayHit& nearest = *static_cast<dParallelSAPRayHit*>(data);
  dContactGeom contact;
  const dGeomID geom = dGeomGetClass(o1) == dRayClass ? o2 : o1;
  const dGeomID ray = geom == o1 ? o2 : o1;
  if (!dCollide(ray, geom, 1, &contact, sizeof contact)) return;
  if (nearest.geom && nearest.distance <= contact.depth) return;
  nearest.geom = geom;
  nearest.distance = contact.depth;
}

// Microseconds a ray. The other rays of a batch would take as long.
double loop(dSpaceID space, const Rays& rays, std::size_t sample, std::vector<dReal>& distances) {
  const std::size_t count = std::min(sample, rays.size());
  const dGeomID ray = dCreateRay(nullptr, 1);
  distances.clear();
  const Stopwatch clock;
  for (std::size_t i = 0; i < count; ++i) {
    const dParallelSAPRay& asked = rays[i * (rays.size() / count)];
    dGeomRaySet(ray, asked.origin[0], asked.origin[1], asked.origin[2], asked.direction[0],
                asked.direction[1], asked.direction[2]);
    dGeomRaySetLength(ray, asked.length);
    dParallelSAPRayHit hit = {};
    dSpaceCollide2(ray, reinterpret_cast<dGeomID>(space), &hit, keepNearest);
    distances.push_back(hit.geom ? hit.distance : -1);
  }
  const double us = 1000 * clock.milliseconds() / static_cast<double>(count);
  dGeomDestroy(ray);
  return us;
}

double cast(dSpaceID space, const Rays& rays, Hits& hits) {
  const Stopwatch clock;
  dParallelSAPSpaceRays(space, rays.data(), rays.size(), 0, hits.data());
  return 1000 * clock.milliseconds() / static_cast<double>(rays.size());
}

void compare(const std::vector<dReal>& loop, const Hits& hits, const std::string& name) {
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const dParallelSAPRayHit& hit = hits[i * (hits.size() / loop.size())];
    if ((hit.geom ? hit.distance : -1) != loop[i])
      throw std::runtime_error("wrong: " + name + " has another hit of ray " + std::to_string(i));
  }
}

struct Cell {
  std::string kind, shapes;
  std::size_t n, rays;
  double moving;
};

void report(const Cell& cell, const std::string& what, int threads, std::vector<double> us,
            double hits, Csv& csv) {
  std::sort(us.begin(), us.end());
  const double median = us[us.size() / 2];
  std::printf("%-8s %-7s %8zu %8zu %6g %-32s %7d %12.3f %7.3f\n", cell.kind.c_str(),
              cell.shapes.c_str(), cell.n, cell.rays, cell.moving, what.c_str(), threads, median,
              hits);
  std::fflush(stdout);
  csv.write(Row()
                .add("kind", cell.kind)
                .add("shapes", cell.shapes)
                .add("n", cell.n)
                .add("rays", cell.rays)
                .add("moving", cell.moving)
                .add("what", what)
                .add("threads", static_cast<std::size_t>(threads))
                .add("us_per_ray", median)
                .add("min_us_per_ray", us[0])
                .add("hits_per_ray", hits)
                .addMachine());
}

void run(const Cell& cell, const Wishes& wishes, Csv& csv) {
  Scene scene("parallel-sap", cell.shapes, cell.n);
  const Rays rays = raysOf(cell.kind, cell.rays, scene.side());
  Hits hits(rays.size());
  for (const int threads : wishes.threads) {
    dParallelSAPSpaceSetNumThreads(scene.space(), threads);
    std::vector<double> us;
    for (int round = 0; round <= wishes.rounds; ++round) {
      scene.move(cell.moving);
      const double time = cast(scene.space(), rays, hits);
      if (round > 0) us.push_back(time);
    }
    double found = 0;
    for (const dParallelSAPRayHit& hit : hits) found += hit.geom != nullptr;
    report(cell, "dParallelSAPSpaceRays", threads, us, found / static_cast<double>(rays.size()),
           csv);
  }
  for (const std::string& name : wishes.spaces) {
    Scene other(name, cell.shapes, cell.n);
    const std::size_t sample = name == "parallel-sap" ? 20 * wishes.sample : wishes.sample;
    std::vector<double> us;
    std::vector<dReal> distances;
    // As many moves as above, so that the hits are the same.
    const int moves = static_cast<int>(wishes.threads.size()) * (wishes.rounds + 1);
    for (int move = 0; move < moves; ++move) {
      other.move(cell.moving);
      if (move + wishes.rounds < moves) continue;
      us.push_back(loop(other.space(), rays, sample, distances));
    }
    compare(distances, hits, name);
    report(
        cell, name + ", dSpaceCollide2", 1, us,
        static_cast<double>(distances.size() - static_cast<std::size_t>(std::count(
                                                   distances.begin(), distances.end(), real(-1)))) /
            static_cast<double>(distances.size()),
        csv);
  }
}

void runAll(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%-8s %-7s %8s %8s %6s %-32s %7s %12s %7s\n", "kind", "shapes", "geoms", "rays",
              "moving", "what", "threads", "us a ray", "hits");
  for (const std::string& kind : wishes.kinds)
    for (const std::string& shapes : wishes.shapes)
      for (const std::size_t n : wishes.sizes)
        for (const std::size_t rays : wishes.rays)
          for (const double moving : wishes.moving)
            run({kind, shapes, n, rays, moving}, wishes, csv);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program("ray-benchmark: the nearest hits of batches of rays");
  program.add("--spaces", wishes.spaces, "whose dSpaceCollide2 is looped over");
  program.add("--kinds", wishes.kinds, "lidar (a fan), pickers (through all), short")
      ->check(CLI::IsMember({"lidar", "pickers", "short"}));
  program.add("--shapes", wishes.shapes, "mixed or boxes");
  program.add("--sizes", wishes.sizes, "geoms in the space");
  program.add("--rays", wishes.rays, "rays of a batch");
  program.add("--threads", wishes.threads, "of the batch; 0: as many as there are");
  program.add("--moving", wishes.moving, "part of the geoms that moves between two batches");
  program.add("--sample", wishes.sample, "rays of a loop in ODE's spaces, 20 times in this one");
  program.add("--rounds", wishes.rounds, "batches that are timed");
  program.add(wishes.csv);
  return program.run(argc, argv, [&] { bench::runAll(wishes); });
}
