// What rays, probes and spaces against a space cost, here and in ODE's spaces, while none, some or
// all of the space's geoms move between the steps: dSpaceCollide2, and dParallelSAPSpaceRays beside
// a loop of dSpaceCollide2 that looks for the nearest hits.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "moving_cubes.h"
#include "program.h"

namespace bench {
namespace {

using sap_test::Random;

struct Kind {
  const char* name;
  enum { kOneByOne, kAsSpace, kNearest } how;
  double length;  // of rays; 0: the queries are unit cubes
  bool all_move;  // the queries are in a space of ours and move
};
constexpr Kind kinds[] = {
    {"rays", Kind::kOneByOne, 10, false},  {"short-rays", Kind::kOneByOne, 2, false},
    {"probes", Kind::kOneByOne, 0, false}, {"space", Kind::kAsSpace, 0, false},
    {"spaces", Kind::kAsSpace, 0, true},   {"nearest", Kind::kNearest, 1e3, false}};
constexpr char batch[] = "parallel-sap:batch";

struct Wishes {
  std::vector<std::string> spaces{"parallel-sap", batch, "dHashSpace", "dQuadTreeSpace",
                                  "dSimpleSpace"};
  std::vector<std::string> kinds{"rays", "short-rays", "probes", "space", "nearest"};
  std::vector<std::size_t> sizes{32000};
  std::vector<std::size_t> queries{1000};
  std::vector<double> moving{0, 0.01, 1};
  std::vector<int> threads{0};
  Timing timing;
};

dSpaceID createSpace(const std::string& name, double side) {
  if (name == "parallel-sap" || name == batch) return dParallelSAPSpaceCreate(nullptr);
  if (name == "dHashSpace") return dHashSpaceCreate(nullptr);
  if (name == "dSimpleSpace") return dSimpleSpaceCreate(nullptr);
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
  std::vector<double> times{};    // of a step
  std::vector<double> answers{};  // of each step
  std::size_t hits = 0;           // in the first one
};

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

// Unit cubes in a space of some kind, and what is asked of it.
class Scene {
 public:
  Scene(const Cell& cell, const Kind& kind, std::size_t n, std::size_t queries)
      : kind_(kind),
        is_batch_(cell.space == batch),
        // Where rays end at what they hit the cubes are further apart: a street, not a heap.
        spread_(kind.how == Kind::kNearest ? 4 : 1),
        side_(std::cbrt(static_cast<double>(n)) * 0.95 * spread_),
        cubes_(createSpace(cell.space, side_)),
        probes_(kind.all_move ? dParallelSAPSpaceCreate(nullptr) : dSimpleSpaceCreate(nullptr)) {
    if (dSpaceIsParallelSAP(cubes_.space()))
      dParallelSAPSpaceSetNumThreads(cubes_.space(), cell.threads);
    for (sap_test::Box box : sap_test::denseCube(n, 1)) {
      for (double* bounds : {box.low, box.high})
        for (int axis = 0; axis < 3; ++axis) bounds[axis] *= spread_;
      cubes_.add(box, false);
    }
    Random random(2);
    for (std::size_t i = 0; i < queries; ++i) addQuery(random);
    hits_.resize(queries);
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
    if (kind_.all_move && movers > 0)
      for (const dGeomID query : queries_) {
        const dReal* const at = dGeomGetPosition(query);
        dGeomSetPosition(query, at[0], at[1], at[2]);
      }
  }

  // Milliseconds of all queries of a step.
  double ask() {
    const dGeomID space = reinterpret_cast<dGeomID>(cubes_.space());
    pairs_ = 0;
    const Stopwatch clock;
    if (is_batch_)
      dParallelSAPSpaceRays(cubes_.space(), rays_.data(), rays_.size(), 0, hits_.data());
    else if (kind_.how == Kind::kAsSpace)
      dSpaceCollide2(space, reinterpret_cast<dGeomID>(probes_), &pairs_, countPair);
    else if (kind_.how == Kind::kOneByOne)
      for (const dGeomID query : queries_) dSpaceCollide2(space, query, &pairs_, countPair);
    else
      for (std::size_t i = 0; i < queries_.size(); ++i) {
        hits_[i] = {};
        dSpaceCollide2(queries_[i], space, &hits_[i], keepNearest);
      }
    return clock.milliseconds();
  }

  // Pairs, or rays that hit something.
  std::size_t hits() const {
    if (kind_.how != Kind::kNearest) return pairs_;
    return static_cast<std::size_t>(std::count_if(
        hits_.begin(), hits_.end(), [](const dParallelSAPRayHit& hit) { return hit.geom; }));
  }
  // What all spaces must agree about: the hits, and their distances if these are asked for.
  double answer() const {
    double sum = static_cast<double>(hits());
    if (kind_.how == Kind::kNearest)
      for (const dParallelSAPRayHit& hit : hits_)
        if (hit.geom) sum += static_cast<double>(hit.distance);
    return sum;
  }

 private:
  void addQuery(Random& random) {
    dReal at[3], way[3];
    for (dReal& coordinate : at) coordinate = static_cast<dReal>(random.between(0, side_));
    if (kind_.length == 0) {
      queries_.push_back(dCreateBox(probes_, 1, 1, 1));
      dGeomSetPosition(queries_.back(), at[0], at[1], at[2]);
      return;
    }
    for (dReal& part : way) part = static_cast<dReal>(random.gauss());
    dParallelSAPRay ray = {};
    ray.category_bits = ray.collide_bits = ~0ul;
    std::copy_n(at, 3, ray.origin);
    std::copy_n(way, 3, ray.direction);
    ray.length = static_cast<dReal>(kind_.length);
    rays_.push_back(ray);
    queries_.push_back(dCreateRay(probes_, ray.length));
    dGeomRaySet(queries_.back(), at[0], at[1], at[2], way[0], way[1], way[2]);
  }

  const Kind& kind_;
  const bool is_batch_;
  const double spread_, side_;
  MovingCubes cubes_;
  dSpaceID probes_;
  std::vector<dGeomID> queries_;
  std::vector<dParallelSAPRay> rays_;
  std::vector<dParallelSAPRayHit> hits_;
  std::size_t next_ = 0, pairs_ = 0;
};

// All spaces saw the same steps, as far as each got.
void compareAnswers(const std::vector<Cell>& cells) {
  for (const Cell& cell : cells)
    for (std::size_t i = 0; i < std::min(cell.answers.size(), cells[0].answers.size()); ++i)
      if (cell.answers[i] != cells[0].answers[i])
        throw std::runtime_error("wrong: " + cell.space + " answers " +
                                 std::to_string(cell.answers[i]) + ", " + cells[0].space + " " +
                                 std::to_string(cells[0].answers[i]));
}

std::vector<Cell> cellsOf(const Kind& kind, const Wishes& wishes) {
  std::vector<Cell> cells;
  for (const std::string& space : wishes.spaces) {
    if (space == batch && kind.how != Kind::kNearest) continue;
    const bool takes_threads = space == "parallel-sap" || space == batch;
    for (const int threads : takes_threads ? wishes.threads : std::vector<int>{1})
      cells.push_back(Cell{space, threads});
  }
  return cells;
}

void run(const Kind& kind, std::size_t n, std::size_t queries, double moving, const Timing& timing,
         std::vector<Cell> cells, Csv& csv) {
  for (int round = 0; round < timing.rounds; ++round)
    for (Cell& cell : cells) {
      Scene scene(cell, kind, n, queries);
      cell.answers.clear();
      timeFrames(cell.times, 3, timing, [&] {
        scene.move(moving);
        const double ms = scene.ask();
        cell.answers.push_back(scene.answer());
        if (cell.answers.size() == 1) cell.hits = scene.hits();
        return ms;
      });
    }
  compareAnswers(cells);
  for (const Cell& cell : cells)
    csv.write(
        Row()
            .add("kind", kind.name)
            .add("n", n)
            .add("queries", queries)
            .add("moving", moving)
            .add("space", cell.space)
            .add("threads", cell.threads)
            .addTimes(cell.times)
            .add("us_per_query", 1000 * median(cell.times) / static_cast<double>(queries))
            .add("hits_per_query", static_cast<double>(cell.hits) / static_cast<double>(queries)));
}

void runAll(const Wishes& wishes) {
  Csv csv(wishes.timing.csv);
  for (const Kind& kind : kinds)
    if (std::count(wishes.kinds.begin(), wishes.kinds.end(), kind.name))
      for (const std::size_t n : wishes.sizes)
        for (const std::size_t queries : wishes.queries)
          for (const double moving : wishes.moving)
            run(kind, n, queries, moving, wishes.timing, cellsOf(kind, wishes), csv);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program("query-benchmark: rays, probes and spaces against a space of unit cubes");
  std::vector<std::string> names;
  for (const bench::Kind& kind : bench::kinds) names.push_back(kind.name);
  program.add("--spaces", wishes.spaces);
  program
      .add("--kinds", wishes.kinds,
           "rays (ten cubes long), short-rays (two), probes (unit cubes), space (one of the "
           "probes), spaces (the same, of ours, whose probes move), nearest (rays that end at "
           "their nearest hits)")
      ->check(CLI::IsMember(names));
  program.add("--sizes", wishes.sizes, "geoms in the space");
  program.add("--queries", wishes.queries, "rays or probes a step");
  program.add("--moving", wishes.moving, "part of the geoms that moves between two steps");
  program.add("--threads", wishes.threads, "of our space; 0: as many as it takes by itself");
  program.add(wishes.timing);
  return program.run(argc, argv, [&] { bench::runAll(wishes); });
}
