// The paper's two steps, AABB update and overlap, on the piles of examples/pile with all their
// geoms (boxes, spheres and meshes on bodies, and the ground), method by method and thread by
// thread. The bodies are put where they were recorded, so every method is shown the same frames. Of
// a recording of a whole run (balls-run) each moment is measured by itself: two frames in turn.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "pile_recording.h"
#include "presets.h"
#include "program.h"
#include "world.h"

namespace bench {
namespace {

struct Wishes {
  std::string piles = ".";
  std::vector<std::string> scenes{"cubes", "balls", "skittles"};
  std::vector<std::string> methods{"brute-force", "sweep"};
  std::vector<int> threads{1, 2};
  std::vector<int> devices{1};
  Timing timing{3, 0.3, 0, {}};
};

struct Method {
  const char* name;
  int backend, method;
};
constexpr Method methods[] = {
    {"brute-force", dParallelSAPBackendCPU, dParallelSAPMethodBruteForce},
    {"sweep", dParallelSAPBackendCPU, dParallelSAPMethodSweep},
    {"axis-lists", dParallelSAPBackendCPU, dParallelSAPMethodAxisLists},
    {"cuda", dParallelSAPBackendCUDA, dParallelSAPMethodSweep},
    {"cuda-axis-lists", dParallelSAPBackendCUDA, dParallelSAPMethodAxisLists},
};

const Method& methodOf(const std::string& name) {
  for (const Method& method : methods)
    if (name == method.name) return method;
  throw std::invalid_argument("no method " + name);
}

// One method with one number of threads and devices on one scene, over all turns.
struct Cell {
  const Method& method;
  int threads;
  int devices;  // 0: on the CPU
  std::vector<dParallelSAPStats> samples{};
};

class Pile {
 public:
  Pile(const std::string& scene, const std::string& directory)
      : recording_(readPileWithPoses(directory + "/" + scene + ".pile")) {
    const pile::Preset& preset = pile::presetOf(scene.substr(0, scene.find("-run")));
    pile::Random random(1);
    preset.build(world_, preset.bodies, random);
    if (world_.bodies().size() != recording_.poses.front().size())
      throw std::runtime_error(scene + ": another number of bodies than recorded; record it anew");
    space_ = dParallelSAPSpaceCreate(nullptr);
    world_.useSpace(space_);
    chooseMoment(0);
  }

  // A recording of piles at rest is one moment.
  std::size_t moments() const { return recording_.steps.empty() ? 1 : recording_.poses.size() / 2; }
  void chooseMoment(std::size_t moment) {
    first_ = 2 * moment;
    count_ = recording_.steps.empty() ? recording_.poses.size() : 2;
    show(0);
    expected_ = countAllPairs();
  }
  // The step at which the moment ends; 0 if the recording is none of a run.
  std::uint32_t step() const { return recording_.steps.empty() ? 0 : recording_.steps[first_ + 1]; }

  // False where back end or method is not to be had.
  bool use(const Cell& cell) {
    if (!dParallelSAPSpaceSetBackend(space_, cell.method.backend) ||
        !dParallelSAPSpaceSetMethod(space_, cell.method.method))
      return false;
    dParallelSAPSpaceSetNumThreads(space_, cell.threads);
    dParallelSAPSpaceSetNumDevices(space_, cell.devices);
    return true;
  }

  // Whether what is asked for is what runs: not where there are fewer devices, or too little
  // memory.
  bool check(const Cell& cell) {
    show(0);
    const dParallelSAPStats stats = collide();
    if (stats.pairs != expected_)
      throw std::runtime_error("wrong: " + std::to_string(stats.pairs) + " pairs instead of " +
                               std::to_string(expected_));
    return stats.method == cell.method.method && stats.backend == cell.method.backend &&
           stats.devices == cell.devices;
  }

  dParallelSAPStats next() {
    const int last = static_cast<int>(count_) - 1;
    const int phase = ++frame_ % (2 * last);
    show(static_cast<std::size_t>(phase <= last ? phase : 2 * last - phase));
    return collide();
  }

  std::size_t geoms() const { return world_.geoms().size(); }
  std::size_t bodies() const { return world_.bodies().size(); }

 private:
  void show(std::size_t frame) {
    for (std::size_t i = 0; i < world_.bodies().size(); ++i) {
      const BodyPose& pose = recording_.poses[first_ + frame][i];
      dBodySetPosition(world_.bodies()[i], pose.position[0], pose.position[1], pose.position[2]);
      dBodySetQuaternion(world_.bodies()[i], pose.rotation);
    }
  }

  dParallelSAPStats collide() {
    std::size_t pairs = 0;
    dSpaceCollide(space_, &pairs, countPair);
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(space_, &stats);
    if (pairs != stats.pairs) throw std::runtime_error("the statistics miscount the pairs");
    return stats;
  }

  // All of them, by the bounds that ODE tells.
  std::size_t countAllPairs() const {
    struct Bounds {
      dReal value[6];
    };
    std::vector<Bounds> all(geoms());
    for (std::size_t i = 0; i < all.size(); ++i) dGeomGetAABB(world_.geoms()[i], all[i].value);
    std::size_t pairs = 0;
    for (std::size_t i = 0; i < all.size(); ++i)
      for (std::size_t j = i + 1; j < all.size(); ++j) {
        const dReal *a = all[i].value, *b = all[j].value;
        pairs += a[0] <= b[1] && b[0] <= a[1] && a[2] <= b[3] && b[2] <= a[3] && a[4] <= b[5] &&
                 b[4] <= a[5];
      }
    return pairs;
  }

  pile::World world_;
  PileRecording recording_;
  dSpaceID space_;
  std::size_t first_ = 0, count_ = 0;  // frames of the moment
  std::size_t expected_ = 0;
  int frame_ = 0;
};

void takeTurn(Pile& pile, Cell& cell, const Timing& timing) {
  if (!pile.use(cell) || !pile.check(cell)) return;
  std::vector<double> times;
  pile.next();  // what the method still has to allocate
  timeFrames(times, 0, timing, [&] {
    cell.samples.push_back(pile.next());
    return cell.samples.back().total_ms;
  });
}

std::vector<double> timesOf(const Cell& cell, double dParallelSAPStats::*stage) {
  std::vector<double> values;
  for (const dParallelSAPStats& stats : cell.samples) values.push_back(stats.*stage);
  return values;
}

Row rowOf(const Pile& pile, const std::string& scene, const Cell& cell) {
  const dParallelSAPStats& last = cell.samples.back();
  Row row;
  row.add("scene", scene)
      .add("step", static_cast<std::size_t>(pile.step()))
      .add("bodies", pile.bodies())
      .add("geoms", pile.geoms())
      .add("method", std::string(cell.method.name))
      .add("threads", cell.threads)
      .add("threads_used", last.threads)
      .add("devices", cell.devices)
      .add("devices_used", last.devices)
      .add("samples", cell.samples.size())
      .add("pairs", static_cast<std::size_t>(last.pairs))
      .add("update_ms", median(timesOf(cell, &dParallelSAPStats::update_ms)))
      .add("synchronise_ms", median(timesOf(cell, &dParallelSAPStats::synchronise_ms)))
      .add("overlap_ms", median(timesOf(cell, &dParallelSAPStats::extract_ms)))
      .add("filter_ms", median(timesOf(cell, &dParallelSAPStats::filter_ms)))
      .add("report_ms", median(timesOf(cell, &dParallelSAPStats::report_ms)))
      .add("total_ms", median(timesOf(cell, &dParallelSAPStats::total_ms)))
      .add("min_update_ms", least(timesOf(cell, &dParallelSAPStats::update_ms)))
      .add("min_overlap_ms", least(timesOf(cell, &dParallelSAPStats::extract_ms)))
      .add("min_total_ms", least(timesOf(cell, &dParallelSAPStats::total_ms)));
  return row;
}

std::vector<Cell> cellsOf(const Wishes& wishes) {
  std::vector<Cell> cells;
  for (const std::string& name : wishes.methods) {
    const Method& method = methodOf(name);
    const bool on_devices = method.backend == dParallelSAPBackendCUDA;
    for (int devices : on_devices ? wishes.devices : std::vector<int>{0})
      for (int threads : wishes.threads) cells.push_back(Cell{method, threads, devices});
  }
  return cells;
}

void run(const Wishes& wishes) {
  Csv csv(wishes.timing.csv);
  for (const std::string& scene : wishes.scenes) {
    Pile pile(scene, wishes.piles);
    for (std::size_t moment = 0; moment < pile.moments(); ++moment) {
      pile.chooseMoment(moment);
      std::vector<Cell> cells = cellsOf(wishes);
      for (int round = 0; round < wishes.timing.rounds; ++round)
        for (Cell& cell : cells) takeTurn(pile, cell, wishes.timing);
      for (const Cell& cell : cells)
        if (cell.samples.empty())
          std::printf("%s: %s is not to be had here\n", scene.c_str(), cell.method.name);
        else
          csv.write(rowOf(pile, scene, cell));
    }
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  wishes.piles = bench::folderOf(argv[0]);
  bench::Program program("pile-benchmark: AABB update and overlap time on recorded piles");
  program.add("--piles", wishes.piles, "where record-piles wrote; default: beside the program");
  program.add("--scenes", wishes.scenes);
  program.add("--methods", wishes.methods, "brute-force, sweep, axis-lists, cuda, cuda-axis-lists");
  program.add("--threads", wishes.threads)->check(CLI::PositiveNumber);
  program.add("--devices", wishes.devices, "GPUs, of the methods that run on them");
  program.add(wishes.timing);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
