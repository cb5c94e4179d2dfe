// The narrow phase of piles of examples/pile: dCollide in a loop against
// dParallelSAPSpaceCollideContacts on several numbers of threads, on the same frames, in turn. Ends
// with an error where contacts differ in a bit.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "csv.h"
#include "presets.h"
#include "program.h"
#include "simulation.h"
#include "spaces.h"
#include "stopwatch.h"

namespace bench {
namespace {

struct Wishes {
  std::vector<std::string> scenes{"cubes", "torus", "skittles"};
  std::vector<int> threads{1, 2};
  int steps = 0;    // before the first frame that is timed; 0: half of the scene's
  int frames = 20;  // that are timed, every tenth step
  CsvFile csv;
};

// Of a loop (0 threads) or of the space; what the pile's table calls narrow phase.
struct Cell {
  int threads;
  std::vector<double> ms;         // with the report
  std::vector<double> report_ms;  // of them
};

bool sameBits(const std::vector<dContactGeom>& a, const std::vector<dContactGeom>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (std::memcmp(a[i].pos, b[i].pos, 3 * sizeof(dReal)) != 0 ||
        std::memcmp(a[i].normal, b[i].normal, 3 * sizeof(dReal)) != 0 ||
        std::memcmp(&a[i].depth, &b[i].depth, sizeof(dReal)) != 0 || a[i].g1 != b[i].g1 ||
        a[i].g2 != b[i].g2 || a[i].side1 != b[i].side1 || a[i].side2 != b[i].side2)
      return false;
  return true;
}

class Scene {
 public:
  Scene(const pile::Preset& preset, int most_threads) : options_(optionsOf(preset, most_threads)) {
    pile::Random random(options_.seed);
    preset.build(world_, options_.bodies, random);
    world_.useSpace(pile::createSpace(options_, world_.geoms()));
    simulation_.emplace(world_, options_);
  }

  void step() { simulation_->step(); }
  std::size_t pairs() const { return pairs_.size(); }
  std::size_t contacts() const { return expected_.size(); }

  // All cells on the frame as it is, each a first time untimed: a thread's caches hold then what
  // they would from the last step. `turn` chooses who begins.
  void measure(std::vector<Cell>& cells, std::size_t turn) {
    pairs_.clear();
    dSpaceCollide(world_.space(), &pairs_, [](void* pairs, dGeomID first, dGeomID second) {
      static_cast<std::vector<pile::Pair>*>(pairs)->push_back({first, second});
    });
    pile::NarrowPhase narrow_phase(options_.contacts);
    narrow_phase.run(pairs_, expected_);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      Cell& cell = cells[(i + turn) % cells.size()];
      runCell(cell, narrow_phase);
      const auto [ms, report_ms] = runCell(cell, narrow_phase);
      cell.ms.push_back(ms);
      cell.report_ms.push_back(report_ms);
    }
    dParallelSAPSpaceSetNumThreads(world_.space(), *options_.threads);
  }

 private:
  static pile::Options optionsOf(const pile::Preset& preset, int threads) {
    pile::Options options;
    options.scene = preset.name;
    options.bodies = preset.bodies;
    options.steps = preset.steps;
    options.dt = preset.dt;
    options.iterations = preset.iterations;
    options.contacts = preset.contacts;
    options.threads = threads;
    options.parallel_narrow = true;
    return options;
  }

  std::pair<double, double> runCell(const Cell& cell, pile::NarrowPhase& narrow_phase) {
    dParallelSAPStats stats = {};
    if (cell.threads == 0) {
      const Stopwatch clock;
      narrow_phase.run(pairs_, found_);
      stats.narrow_ms = clock.milliseconds();
    } else {
      dParallelSAPSpaceSetNumThreads(world_.space(), cell.threads);
      narrow_phase.run(world_.space(), found_);
      dParallelSAPSpaceGetStats(world_.space(), &stats);
    }
    if (!sameBits(found_, expected_))
      throw std::runtime_error("contacts differ with " + std::to_string(cell.threads) + " threads");
    return {stats.narrow_ms + stats.report_ms, stats.report_ms};
  }

  const pile::Options options_;
  pile::World world_;
  std::optional<pile::Simulation> simulation_;
  std::vector<pile::Pair> pairs_;
  std::vector<dContactGeom> found_, expected_;
};

void run(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%-10s %7s %9s %9s %9s %9s %8s\n", "scene", "threads", "pairs", "contacts", "ms",
              "report", "times");
  for (const std::string& name : wishes.scenes) {
    const pile::Preset& preset = pile::presetOf(name);
    std::vector<Cell> cells = {{0, {}, {}}};
    for (const int threads : wishes.threads) cells.push_back({threads, {}, {}});
    Scene scene(preset, wishes.threads.back());
    for (int step = 0; step < (wishes.steps ? wishes.steps : preset.steps / 2); ++step)
      scene.step();
    for (int frame = 0; frame < wishes.frames; ++frame) {
      for (int step = 0; step < 10; ++step) scene.step();
      scene.measure(cells, static_cast<std::size_t>(frame));
    }
    for (const Cell& cell : cells) {
      const double times = median(cells[0].ms) / median(cell.ms);
      std::printf("%-10s %7d %9zu %9zu %9.3f %9.3f %8.2f\n", preset.name, cell.threads,
                  scene.pairs(), scene.contacts(), median(cell.ms), median(cell.report_ms), times);
      std::fflush(stdout);
      csv.write(Row()
                    .add("scene", preset.name)
                    .add("bodies", preset.bodies)
                    .add("threads", cell.threads)
                    .add("pairs", scene.pairs())
                    .add("contacts", scene.contacts())
                    .addTimes(cell.ms)
                    .add("report_ms", median(cell.report_ms))
                    .add("times", times)
                    .addMachine());
    }
  }
}

// ODE complains, thousands of times, when two fine meshes touch in many points.
void passOver(int, const char* format, va_list arguments) {
  char text[512];
  std::vsnprintf(text, sizeof text, format, arguments);
  if (std::strstr(text, "parallel SAP space")) std::fprintf(stderr, "%s\n", text);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program(
      "narrow-benchmark: contacts of piles in a loop (0 threads) and on several threads");
  std::vector<std::string> names;
  for (const pile::Preset& preset : pile::presets()) names.push_back(preset.name);
  program.add("--scenes", wishes.scenes)->check(CLI::IsMember(names));
  program.add("--threads", wishes.threads, "the last number also makes the steps between")
      ->check(CLI::PositiveNumber);
  program.add("--steps", wishes.steps, "before the first timed frame; 0: half of the scene's");
  program.add("--frames", wishes.frames, "that are timed, every tenth step")
      ->check(CLI::PositiveNumber);
  program.add(wishes.csv);
  dSetMessageHandler(bench::passOver);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
