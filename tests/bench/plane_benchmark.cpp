// What planes cost: a cube of moving bodies alone, on a ground plane, and in a bowl of oblique
// planes, with the planes reported against every geom, as ODE's spaces do, and culled.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "csv.h"
#include "random.h"
#include "scenes.h"
#include "stopwatch.h"

namespace bench {
namespace {

using sap_test::Random;

struct Wishes {
  std::vector<std::size_t> sizes{10000, 100000};
  std::vector<int> threads{1};
  int planes = 40;
  double seconds = 0.5;  // of collides in a turn
  int rounds = 3;        // turns of each variant
  bool stock = true;     // dHashSpace and dSweepAndPruneSpace too
  std::string csv;
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

void count(void* data, dGeomID, dGeomID) {
  ++*static_cast<std::size_t*>(data);
}

class Scene {
 public:
  Scene(const Variant& variant, std::size_t n, int planes, int threads) : space_(variant.create()) {
    if (variant.ours) {
      dParallelSAPSpaceSetNumThreads(space_, threads);
      dParallelSAPSpaceSetCullPlanes(space_, variant.cull);
    }
    const double side = std::cbrt(static_cast<double>(n)) * 0.95;
    if (variant.ground) dCreatePlane(space_, 0, 0, 1, 0);
    Random random(2);
    for (int i = 0; variant.bowl && i < planes; ++i) {
      // Their open sides hold the ball around the cube, but for its outermost shell.
      double normal[3], length = 0, through = 0;
      for (double& part : normal) part = random.gauss();
      for (const double part : normal) length += part * part;
      length = std::sqrt(length);
      for (const double part : normal) through += part / length * side / 2;
      dCreatePlane(space_, static_cast<dReal>(normal[0]), static_cast<dReal>(normal[1]),
                   static_cast<dReal>(normal[2]),
                   static_cast<dReal>(through - 0.85 * side) * static_cast<dReal>(length));
    }
    world_ = dWorldCreate();
    for (const sap_test::Box& box : sap_test::denseCube(n, 1)) {
      const dGeomID geom = dCreateBox(space_, 1, 1, 1);
      const dBodyID body = dBodyCreate(world_);
      dGeomSetBody(geom, body);
      bodies_.push_back(body);
      for (int axis = 0; axis < 3; ++axis)
        places_.push_back(static_cast<dReal>((box.low[axis] + box.high[axis]) / 2));
    }
  }
  ~Scene() {
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  // Milliseconds of a collide, after every body has moved a little.
  double next() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      dReal at[3];
      for (std::size_t axis = 0; axis < 3; ++axis)
        at[axis] = places_[3 * i + axis] + static_cast<dReal>(random_.between(-0.1, 0.1));
      dBodySetPosition(bodies_[i], at[0], at[1], at[2]);
    }
    pairs_ = 0;
    const Stopwatch clock;
    dSpaceCollide(space_, &pairs_, count);
    return clock.milliseconds();
  }
  std::size_t pairs() const { return pairs_; }

 private:
  dSpaceID space_;
  dWorldID world_;
  std::vector<dBodyID> bodies_;
  std::vector<dReal> places_;
  Random random_{3};
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
  Csv csv(wishes.csv, false);
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
                      .add("samples", cell.times.size())
                      .add("median_ms", ms)
                      .add("min_ms", *std::min_element(cell.times.begin(), cell.times.end()))
                      .add("pairs", cell.pairs)
                      .add("ratio", ms / without)
                      .addMachine());
      }
    }
}

const char usage[] =
    R"(plane-benchmark: what planes cost among moving bodies, reported with every geom and culled

  --sizes=n,n,...    bodies; default 10000,100000
  --threads=t,t,...  default 1
  --planes=p         oblique planes of the bowl; default 40
  --rounds=r         turns of each variant; default 3
  --seconds=s        of collides in a turn; default 0.5
  --stock=0          leave ODE's spaces out
  --csv=file
)";

template <class Number>
std::vector<Number> numbers(const std::string& text) {
  std::vector<Number> found;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    found.push_back(static_cast<Number>(std::stod(text.substr(begin, end - begin))));
    begin = end + 1;
  }
  return found;
}

Wishes parse(int argc, char** argv) {
  Wishes wishes;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const std::size_t equals = argument.find('=');
    const std::string name = argument.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : argument.substr(equals + 1);
    if (name == "--help") {
      std::fputs(usage, stdout);
      std::exit(0);
    }
    if (value.empty()) throw std::invalid_argument(argument + ": no such option; see --help");
    if (name == "--sizes")
      wishes.sizes = numbers<std::size_t>(value);
    else if (name == "--threads")
      wishes.threads = numbers<int>(value);
    else if (name == "--planes")
      wishes.planes = std::stoi(value);
    else if (name == "--rounds")
      wishes.rounds = std::stoi(value);
    else if (name == "--seconds")
      wishes.seconds = std::stod(value);
    else if (name == "--stock")
      wishes.stock = value != "0";
    else if (name == "--csv")
      wishes.csv = value;
    else
      throw std::invalid_argument(argument + ": no such option; see --help");
  }
  return wishes;
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  dInitODE2(0);
  int result = 0;
  try {
    bench::run(bench::parse(argc, argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "plane-benchmark: %s\n", error.what());
    result = 1;
  }
  dCloseODE();
  return result;
}
