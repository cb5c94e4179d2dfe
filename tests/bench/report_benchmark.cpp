// The report of pairs to callbacks of three kinds: one counts, one asks what near callbacks ask
// first (bodies, joints between them, user data), one goes on to dCollide.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "counting.h"
#include "csv.h"
#include "moving_cubes.h"
#include "program.h"

namespace bench {
namespace {

struct Wishes {
  std::vector<std::size_t> sizes{1000, 10000, 100000, 1000000};
  double seconds = 1;  // of frames, a cell
  CsvFile csv;
};

// What a program hangs on a geom.
struct Thing {
  int kind;
  char more[60];
};

struct Seen {
  std::size_t pairs = 0, results = 0;
};

bool areConnected(dGeomID a, dGeomID b) {
  const dBodyID p = dGeomGetBody(a), q = dGeomGetBody(b);
  return p && q && dAreConnectedExcluding(p, q, dJointTypeContact);
}
void count(void* data, dGeomID, dGeomID) {
  ++static_cast<Seen*>(data)->pairs;
}
void ask(void* data, dGeomID a, dGeomID b) {
  count(data, a, b);
  if (areConnected(a, b)) return;
  const auto kindOf = [](dGeomID geom) { return static_cast<Thing*>(dGeomGetData(geom))->kind; };
  static_cast<Seen*>(data)->results += kindOf(a) == kindOf(b);
}
void collide(void* data, dGeomID a, dGeomID b) {
  count(data, a, b);
  if (areConnected(a, b)) return;
  dContactGeom contacts[4];
  static_cast<Seen*>(data)->results +=
      static_cast<std::size_t>(dCollide(a, b, 4, contacts, sizeof *contacts));
}

struct Callback {
  const char* name;
  dNearCallback* call;
};
constexpr Callback callbacks[] = {{"count", count}, {"ask", ask}, {"collide", collide}};

void run(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%9s %-8s %11s %10s\n", "geoms", "callback", "report ms", "ns a pair");
  for (const std::size_t n : wishes.sizes) {
    MovingCubes cubes(dParallelSAPSpaceCreate(nullptr));
    std::vector<std::unique_ptr<Thing>> things;
    for (const sap_test::Box& box : sap_test::denseCube(n, 1)) {
      things.push_back(std::make_unique<Thing>(Thing{static_cast<int>(things.size() % 4), {}}));
      dGeomSetData(cubes.add(box, true), things.back().get());
    }
    for (const Callback& callback : callbacks) {
      std::vector<double> times;
      Seen seen;
      double spent = 0;
      for (int frame = 0; frame < 4 || spent < 1000 * wishes.seconds; ++frame) {
        for (std::size_t i = 0; i < cubes.size(); ++i) cubes.move(i, 0.01);
        seen = Seen();
        const Stopwatch clock;
        dSpaceCollide(cubes.space(), &seen, callback.call);
        spent += clock.milliseconds();
        dParallelSAPStats stats;
        dParallelSAPSpaceGetStats(cubes.space(), &stats);
        if (frame > 0) times.push_back(stats.report_ms);
      }
      const double ms = median(times);
      std::printf("%9zu %-8s %11.4f %10.2f\n", n, callback.name, ms,
                  1e6 * ms / static_cast<double>(std::max<std::size_t>(seen.pairs, 1)));
      std::fflush(stdout);
      csv.write(Row()
                    .add("n", n)
                    .add("callback", callback.name)
                    .add("pairs", seen.pairs)
                    .addTimes(times)
                    .addMachine());
    }
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program("report-benchmark: what it takes to tell pairs to callbacks");
  program.add("--sizes", wishes.sizes, "geoms");
  program.add("--seconds", wishes.seconds, "of frames, a cell");
  program.add(wishes.csv);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
