// dSpaceCollide2: what rays, probes and spaces against a space cost, here and in ODE's spaces,
// while none, some or all of the space's geoms move between the steps.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "counting.h"
#include "csv.h"
#include "moving_cubes.h"
#include "program.h"

namespace bench {
namespace {

using sap_test::Random;

struct Wishes {
  std::vector<std::string> spaces{"parallel-sap", "dHashSpace", "dQuadTreeSpace", "dSimpleSpace"};
  std::vector<std::string> kinds{"rays", "short-rays", "probes", "space"};
  std::vector<std::size_t> sizes{32000};
  std::vector<std::size_t> queries{1000};
  std::vector<double> moving{0, 0.01, 1};
  std::vector<int> threads{0};
  double seconds = 0.5;  // of timed queries in a turn
  int rounds = 2;        // turns of each space
  CsvFile csv;
};

dSpaceID createSpace(const std::string& name, double side) {
  if (name == "parallel-sap") return dParallelSAPSpaceCreate(nullptr);
  if (name == "dHashSpace") return dHashSpaceCreate(nullptr);
  if (name == "dSimpleSpace") return dSimpleSpaceCreate(nullptr);
  if (name == "dSweepAndPruneSpace") return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
  if (name == "dQuadTreeSpace") {
    const dReal half = static_cast<dReal>(side / 2);
    const dVector3 centre = {half, half, half}, extents = {half, half, half};
    return dQuadTreeSpaceCreate(nullptr, centre, extents, 6);
  }
  throw std::invalid_argument("no space " + name);
}

struct Cell {
  std::string space;
  int threads;
  std::vector<double> times{};  // of a step
  std::vector<std::size_t> hits{};
};

// Unit cubes in a space of some kind, and what is asked of it.
class Scene {
 public:
  Scene(const Cell& cell, const std::string& kind, std::size_t n, std::size_t queries)
      : side_(std::cbrt(static_cast<double>(n)) * 0.95),
        cubes_(createSpace(cell.space, side_)),
        probes_(kind == "spaces" ? dParallelSAPSpaceCreate(nullptr) : dSimpleSpaceCreate(nullptr)),
        as_space_(kind == "space" || kind == "spaces"),
        all_move_(kind == "spaces") {
    if (dSpaceIsParallelSAP(cubes_.space()))
      dParallelSAPSpaceSetNumThreads(cubes_.space(), cell.threads);
    for (const sap_test::Box& box : sap_test::denseCube(n, 1)) cubes_.add(box, false);
    Random random(2);
    for (std::size_t i = 0; i < queries; ++i) queries_.push_back(createQuery(kind, random));
  }
  ~Scene() { dSpaceDestroy(probes_); }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  // A part of the geoms take a step of up to a tenth of their width around their place.
  void move(double part) {
    const std::size_t n = cubes_.size();
    const std::size_t movers = static_cast<std::size_t>(part * static_cast<double>(n));
    for (std::size_t i = 0; i < movers; ++i) cubes_.move((next_ + i) % n, 0.1);
    next_ = (next_ + movers) % n;
    if (all_move_ && movers > 0)
      for (const dGeomID query : queries_) {
        const dReal* const at = dGeomGetPosition(query);
        dGeomSetPosition(query, at[0], at[1], at[2]);
      }
  }

  // Milliseconds of all queries of a step.
  double ask() {
    const dGeomID space = reinterpret_cast<dGeomID>(cubes_.space());
    hits_ = 0;
    const Stopwatch clock;
    if (as_space_)
      dSpaceCollide2(space, reinterpret_cast<dGeomID>(probes_), &hits_, countPair);
    else
      for (const dGeomID query : queries_) dSpaceCollide2(space, query, &hits_, countPair);
    return clock.milliseconds();
  }

  std::size_t hits() const { return hits_; }

 private:
  dGeomID createQuery(const std::string& kind, Random& random) {
    const dReal at[] = {static_cast<dReal>(random.between(0, side_)),
                        static_cast<dReal>(random.between(0, side_)),
                        static_cast<dReal>(random.between(0, side_))};
    if (kind != "rays" && kind != "short-rays") {
      const dGeomID probe = dCreateBox(probes_, 1, 1, 1);
      dGeomSetPosition(probe, at[0], at[1], at[2]);
      return probe;
    }
    const dGeomID ray = dCreateRay(probes_, kind == "rays" ? 10 : 2);
    dGeomRaySet(ray, at[0], at[1], at[2], static_cast<dReal>(random.gauss()),
                static_cast<dReal>(random.gauss()), static_cast<dReal>(random.gauss()));
    return ray;
  }

  const double side_;
  MovingCubes cubes_;
  dSpaceID probes_;
  bool as_space_, all_move_;
  std::vector<dGeomID> queries_;
  std::size_t next_ = 0, hits_ = 0;
};

void takeTurn(Cell& cell, const std::string& kind, std::size_t n, std::size_t queries,
              double moving, double seconds) {
  Scene scene(cell, kind, n, queries);
  constexpr int first_steps = 3;  // not timed
  double spent = 0;
  std::vector<std::size_t> hits;
  for (int step = 0; step < first_steps + 3 || spent < 1000 * seconds; ++step) {
    scene.move(moving);
    const double time = scene.ask();
    hits.push_back(scene.hits());
    if (step < first_steps) continue;
    cell.times.push_back(time);
    spent += time;
  }
  if (hits.size() > cell.hits.size()) cell.hits = hits;
}

// All spaces saw the same steps, as far as each got.
void compareHits(const std::vector<Cell>& cells) {
  for (const Cell& cell : cells)
    for (std::size_t i = 0; i < std::min(cell.hits.size(), cells[0].hits.size()); ++i)
      if (cell.hits[i] != cells[0].hits[i])
        throw std::runtime_error("wrong: " + cell.space + " reports " +
                                 std::to_string(cell.hits[i]) + " pairs, " + cells[0].space + " " +
                                 std::to_string(cells[0].hits[i]));
}

void tell(const Cell& cell, const std::string& kind, std::size_t n, std::size_t queries,
          double moving, Csv& csv) {
  const double ms = median(cell.times), each = 1000 * ms / static_cast<double>(queries);
  const double hits = static_cast<double>(cell.hits.front()) / static_cast<double>(queries);
  std::printf("%-10s %8zu %8zu %7g %-20s %7d %12.4f %12.4f %12.4f %10.2f\n", kind.c_str(), n,
              queries, moving, cell.space.c_str(), cell.threads, ms,
              *std::min_element(cell.times.begin(), cell.times.end()), each, hits);
  std::fflush(stdout);
  csv.write(Row()
                .add("kind", kind)
                .add("n", n)
                .add("queries", queries)
                .add("moving", moving)
                .add("space", cell.space)
                .add("threads", cell.threads)
                .addTimes(cell.times)
                .add("us_per_query", each)
                .add("hits_per_query", hits)
                .addMachine());
}

void run(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%-10s %8s %8s %7s %-20s %7s %12s %12s %12s %10s\n", "kind", "geoms", "queries",
              "moving", "space", "threads", "ms a step", "least", "us a query", "hits");
  for (const std::string& kind : wishes.kinds)
    for (std::size_t n : wishes.sizes)
      for (std::size_t queries : wishes.queries)
        for (double moving : wishes.moving) {
          std::vector<Cell> cells;
          for (const std::string& space : wishes.spaces)
            for (const int threads : space == "parallel-sap" ? wishes.threads : std::vector<int>{1})
              cells.push_back(Cell{space, threads});
          for (int round = 0; round < wishes.rounds; ++round)
            for (Cell& cell : cells) takeTurn(cell, kind, n, queries, moving, wishes.seconds);
          compareHits(cells);
          for (const Cell& cell : cells) tell(cell, kind, n, queries, moving, csv);
        }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program(
      "query-benchmark: dSpaceCollide2 of rays, probes and spaces against a space of unit cubes");
  program.add("--spaces", wishes.spaces, "also dSweepAndPruneSpace");
  program
      .add("--kinds", wishes.kinds,
           "rays (ten cubes long), short-rays (two), probes (unit cubes), space (one of the "
           "probes), spaces (the same, of ours, whose probes move)")
      ->check(CLI::IsMember({"rays", "short-rays", "probes", "space", "spaces"}));
  program.add("--sizes", wishes.sizes, "geoms in the space");
  program.add("--queries", wishes.queries, "rays or probes a step");
  program.add("--moving", wishes.moving, "part of the geoms that moves between two steps");
  program.add("--threads", wishes.threads, "of our space; 0: as many as it takes by itself");
  program.add("--rounds", wishes.rounds, "turns of each space");
  program.add("--seconds", wishes.seconds, "of queries in a turn");
  program.add(wishes.csv);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
