// What planes cost: a cube of moving bodies alone, on a ground plane, and in a bowl of oblique
// planes, with the planes reported against every geom, as ODE's spaces do, and culled.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "counting.h"
#include "csv.h"
#include "moving_cubes.h"
#include "program.h"
#include "random.h"

namespace bench {
namespace {

struct Wishes {
  std::vector<std::size_t> sizes{10000, 100000};
  std::vector<int> threads{1};
  int planes = 40;
  double seconds = 0.5;  // of collides in a turn
  int rounds = 3;        // turns of each variant
  int stock = 1;         // dHashSpace and dSweepAndPruneSpace too
  CsvFile csv;
};

struct Variant {
  const char* name;
  bool ground;
  bool bowl;
  bool cull;
  bool ours;
  dSpaceID (*create)();
};

dSpaceID createOurs() {
  return dParallelSAPSpaceCreate(nullptr);
}
dSpaceID createHash() {
  return dHashSpaceCreate(nullptr);
}
dSpaceID createSap() {
  return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
}

constexpr Variant variants[] = {
    {"no planes", false, false, false, true, createOurs},
    {"ground", true, false, false, true, createOurs},
    {"ground, culled", true, false, true, true, createOurs},
    {"bowl", false, true, false, true, createOurs},
    {"bowl, culled", false, true, true, true, createOurs},
    {"no planes, dHashSpace", false, false, false, false, createHash},
    {"bowl, dHashSpace", false, true, false, false, createHash},
    {"bowl, dSweepAndPruneSpace", false, true, false, false, createSap},
};

class Scene {
 public:
  Scene(const Variant& variant, std::size_t n, int planes, int threads) : cubes_(variant.create()) {
    const dSpaceID space = cubes_.space();
    if (variant.ours) {
      dParallelSAPSpaceSetNumThreads(space, threads);
      dParallelSAPSpaceSetCullPlanes(space, variant.cull);
    }
    const double side = std::cbrt(static_cast<double>(n)) * 0.95;
    if (variant.ground) dCreatePlane(space, 0, 0, 1, 0);
    sap_test::Random random(2);
    for (int i = 0; variant.bowl && i < planes; ++i) {
      // Their open sides hold the ball around the cube, but for its outermost shell.
      double normal[3], length = 0, through = 0;
      for (double& part : normal) part = random.gauss();
      for (const double part : normal) length += part * part;
      length = std::sqrt(length);
      for (const double part : normal) through += part / length * side / 2;
      dCreatePlane(space, static_cast<dReal>(normal[0]), static_cast<dReal>(normal[1]),
                   static_cast<dReal>(normal[2]),
                   static_cast<dReal>(through - 0.85 * side) * static_cast<dReal>(length));
    }
    for (const sap_test::Box& box : sap_test::denseCube(n, 1)) cubes_.add(box, true);
  }

  // Milliseconds of a collide, after every body has moved a little.
  double next() {
    for (std::size_t i = 0; i < cubes_.size(); ++i) cubes_.move(i, 0.1);
    return timeCollide(cubes_.space(), pairs_);
  }
  std::size_t pairs() const { return pairs_; }

 private:
  MovingCubes cubes_;
  std::size_t pairs_ = 0;
};

struct Cell {
  const Variant& variant;
  std::vector<double> times{};
  std::size_t pairs = 0;
};

void takeTurn(Cell& cell, std::size_t n, int threads, const Wishes& wishes) {
  Scene scene(cell.variant, n, wishes.planes, threads);
  scene.next();
  scene.next();
  double spent = 0;
  for (int i = 0; i < 3 || spent < 1000 * wishes.seconds; ++i) {
    cell.times.push_back(scene.next());
    spent += cell.times.back();
    if (i == 0) cell.pairs = scene.pairs();
  }
}

void run(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%8s %7s %-26s %12s %10s %12s\n", "bodies", "threads", "variant", "ms", "pairs",
              "without = 1");
  for (std::size_t n : wishes.sizes)
    for (int threads : wishes.threads) {
      std::vector<Cell> cells;
      for (const Variant& variant : variants)
        if (variant.ours || (wishes.stock && n <= 20000)) cells.push_back(Cell{variant});
      for (int round = 0; round < wishes.rounds; ++round)
        for (Cell& cell : cells) takeTurn(cell, n, threads, wishes);
      const double without = median(cells[0].times);
      for (const Cell& cell : cells) {
        const double ms = median(cell.times);
        std::printf("%8zu %7d %-26s %12.4f %10zu %12.3f\n", n, threads, cell.variant.name, ms,
                    cell.pairs, ms / without);
        csv.write(Row()
                      .add("bodies", n)
                      .add("planes", (cell.variant.bowl ? wishes.planes : 0) + cell.variant.ground)
                      .add("variant", std::string(cell.variant.name))
                      .add("threads", threads)
                      .addTimes(cell.times)
                      .add("pairs", cell.pairs)
                      .add("ratio", ms / without)
                      .addMachine());
      }
    }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program(
      "plane-benchmark: what planes cost among moving bodies, reported with every geom and culled");
  program.add("--sizes", wishes.sizes, "bodies");
  program.add("--threads", wishes.threads)->check(CLI::PositiveNumber);
  program.add("--planes", wishes.planes, "oblique planes of the bowl");
  program.add("--rounds", wishes.rounds, "turns of each variant");
  program.add("--seconds", wishes.seconds, "of collides in a turn");
  program.add("--stock", wishes.stock, "0: leave ODE's spaces out");
  program.add(wishes.csv);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
