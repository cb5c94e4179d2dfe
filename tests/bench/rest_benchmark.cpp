// Scenes of which little moves: what a frame costs against one in which everything does, with all
// pairs reported, with those at rest left out, and with a tolerance.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "counting.h"
#include "csv.h"
#include "moving_cubes.h"
#include "program.h"

namespace bench {
namespace {

enum Movers { kAll, kSome, kOthersEachFrame, kNone };

// What moves, what the others are, and what is asked of the space.
struct Setting {
  const char* name;
  Movers movers;
  bool bodies;  // those that move are on bodies
  bool asleep;  // the others are on disabled bodies
  bool skip_static, skip_asleep;
  double tolerance;
  bool notified;  // it is told of what ODE does not tell, of which there is nothing
};
constexpr Setting settings[] = {
    {"all-move", kAll, false, false, false, false, 0, false},
    {"some-move", kSome, false, false, false, false, 0, false},
    {"some-move-told", kSome, false, false, false, false, 0, true},
    {"none-move", kNone, true, true, false, false, 0, false},
    {"none-move-told", kNone, true, true, false, false, 0, true},
    {"others-move", kOthersEachFrame, false, false, false, false, 0, false},
    {"some-awake", kSome, true, true, false, false, 0, false},
    {"skip-asleep", kSome, true, true, true, true, 0, false},
    {"skip-asleep-told", kSome, true, true, true, true, 0, true},
    {"skip-static", kSome, true, false, true, false, 0, false},
    {"tolerance-0.2", kAll, false, false, false, false, 0.2, false},
    {"tolerance-0.002", kAll, false, false, false, false, 0.002, false},
};

// Of `n` geoms, where `some` is what the user asked for.
std::size_t moversOf(const Setting& setting, std::size_t n, std::size_t some) {
  if (setting.movers == kAll) return n;
  return setting.movers == kNone ? 0 : some;
}

struct Wishes {
  std::vector<std::size_t> sizes{400000};
  std::vector<std::string> names;
  double moving = 0.01;  // part of the geoms, or their number if above 1
  double step = 0.01;    // widths of a box
  double seconds = 2;    // of timed frames in a turn
  int rounds = 2;
  int threads = 1;
  CsvFile csv;
};

class Scene {
 public:
  Scene(const Setting& setting, std::size_t n, std::size_t movers, const Wishes& wishes)
      : setting_(setting),
        movers_(movers),
        step_(wishes.step),
        cubes_(dParallelSAPSpaceCreate(nullptr)) {
    const dSpaceID space = cubes_.space();
    dParallelSAPSpaceSetNumThreads(space, wishes.threads);
    dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
    dParallelSAPSpaceSetSkipStatic(space, setting.skip_static);
    dParallelSAPSpaceSetSkipAsleep(space, setting.skip_asleep);
    dParallelSAPSpaceSetTolerance(space, static_cast<dReal>(setting.tolerance));
    dParallelSAPSpaceSetNotified(space, setting.notified);
    for (const sap_test::Box& box : sap_test::denseCube(n, 1)) {
      const bool moves = cubes_.size() < movers;
      const dGeomID geom = cubes_.add(box, moves ? setting.bodies : setting.asleep);
      if (!moves && setting.asleep) dBodyDisable(dGeomGetBody(geom));
    }
  }

  void move() {
    const std::size_t moves = moversOf(setting_, cubes_.size(), movers_);
    for (std::size_t i = 0; i < moves; ++i)
      cubes_.move(setting_.movers == kOthersEachFrame ? cubes_.any() : i, step_);
  }

  double frame() { return timeCollide(cubes_.space(), pairs_); }
  std::size_t pairs() const { return pairs_; }
  dParallelSAPStats stats() const {
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(cubes_.space(), &stats);
    return stats;
  }

 private:
  const Setting& setting_;
  const std::size_t movers_;
  const double step_;
  MovingCubes cubes_;
  std::size_t pairs_ = 0;
};

struct Cell {
  const Setting* setting;
  std::vector<double> times{};
  std::size_t pairs = 0;
  dParallelSAPStats stats{};
};

void takeTurn(Cell& cell, std::size_t n, std::size_t movers, const Wishes& wishes) {
  Scene scene(*cell.setting, n, movers, wishes);
  constexpr int first_frames = 4;  // not timed
  double spent = 0;
  for (int frame = 0; frame < first_frames + 5 || spent < 1000 * wishes.seconds; ++frame) {
    scene.move();
    const double time = scene.frame();
    if (frame < first_frames) continue;
    cell.times.push_back(time);
    spent += time;
  }
  cell.pairs = scene.pairs();
  cell.stats = scene.stats();
}

void run(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%-14s %9s %8s %7s %11s %11s %8s %10s %10s\n", "setting", "geoms", "movers",
              "threads", "median ms", "mean ms", "ratio", "pairs", "kept");
  for (const std::size_t n : wishes.sizes) {
    const std::size_t movers = static_cast<std::size_t>(
        wishes.moving > 1 ? wishes.moving : wishes.moving * static_cast<double>(n));
    std::vector<Cell> cells;
    for (const Setting& setting : settings)
      if (wishes.names.empty() || &setting == settings ||
          std::find(wishes.names.begin(), wishes.names.end(), setting.name) != wishes.names.end())
        cells.push_back({&setting});
    for (int round = 0; round < wishes.rounds; ++round)
      for (Cell& cell : cells) takeTurn(cell, n, movers, wishes);
    for (const Cell& cell : cells) {
      // The mean, since now and then a frame tidies up for many.
      const double ratio = mean(cell.times) / mean(cells[0].times);
      std::printf("%-14s %9zu %8zu %7d %11.4f %11.4f %8.4f %10zu %10llu\n", cell.setting->name, n,
                  moversOf(*cell.setting, n, movers), wishes.threads, median(cell.times),
                  mean(cell.times), ratio, cell.pairs, cell.stats.kept);
      std::fflush(stdout);
      csv.write(Row()
                    .add("setting", cell.setting->name)
                    .add("n", n)
                    .add("movers", moversOf(*cell.setting, n, movers))
                    .add("threads", wishes.threads)
                    .add("samples", cell.times.size())
                    .add("median_ms", median(cell.times))
                    .add("mean_ms", mean(cell.times))
                    .add("max_ms", *std::max_element(cell.times.begin(), cell.times.end()))
                    .add("ratio", ratio)
                    .add("pairs", cell.pairs)
                    .add("kept", static_cast<std::size_t>(cell.stats.kept))
                    .add("update_ms", cell.stats.update_ms)
                    .add("extract_ms", cell.stats.extract_ms)
                    .add("filter_ms", cell.stats.filter_ms)
                    .add("report_ms", cell.stats.report_ms)
                    .addMachine());
    }
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program(
      "rest-benchmark: frames in which little moves against frames in which all does");
  program.add("--sizes", wishes.sizes, "geoms");
  std::vector<std::string> names;
  for (const bench::Setting& setting : bench::settings) names.push_back(setting.name);
  program.add("--settings", wishes.names, "default: all")->check(CLI::IsMember(names));
  program.add("--moving", wishes.moving, "part of the geoms that moves; above 1: their number")
      ->check(CLI::PositiveNumber);
  program.add("--step", wishes.step, "how far, at most, in widths of a box");
  program.add("--seconds", wishes.seconds, "of frames in a turn");
  program.add("--rounds", wishes.rounds, "turns of each setting");
  program.add("--threads", wishes.threads)->check(CLI::PositiveNumber);
  program.add(wishes.csv);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
