// Real data: the boxes of meshes that move, edges against edges and vertices against faces.
#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "csv.h"
#include "mesh_finder.h"
#include "program.h"
#include "stopwatch.h"

namespace bench {

double MeshFinder::extraction() const {
  return std::numeric_limits<double>::quiet_NaN();
}

namespace {

struct Wishes {
  std::string directory;
  CsvFile csv;
  std::vector<std::size_t> made;           // sides of cloths
  std::vector<std::string> meshes, peers;  // empty: all
  std::vector<int> threads{1};
  double seconds = 1;  // of timed work in a cell
  int rounds = 2;      // turns of each peer
};

// The pairs asked for: within the first group, or between two.
struct Task {
  const Mesh& mesh;
  const char* kind;
  const MeshBoxes& first;
  const MeshBoxes* second;
  std::size_t pairs;

  std::size_t boxes() const { return first.size() + (second ? second->size() : 0); }
};

struct Cell {
  const MeshFinderKind& kind;
  std::vector<double> times{}, extractions{};
  std::size_t extra = 0;
};

bool isWished(const std::vector<std::string>& wishes, const std::string& name) {
  return wishes.empty() || std::find(wishes.begin(), wishes.end(), name) != wishes.end();
}

// Floats may find more pairs; nothing may find fewer, and ours none but these.
void takeTurn(Cell& cell, const Task& task, int threads, double seconds) {
  const auto finder = cell.kind.create(task.first, task.second, threads);
  constexpr int first_frames = 3;  // not timed
  double spent = 0;
  for (int frame = 0; frame < first_frames + 3 || spent < 1000 * seconds; ++frame) {
    finder->move();
    const Stopwatch clock;
    const std::size_t pairs = finder->find();
    const double time = clock.milliseconds();
    const bool ours = cell.kind.name.rfind("parallel-sap", 0) == 0;
    if (pairs < task.pairs || (ours && pairs > task.pairs))
      throw std::runtime_error("wrong: " + cell.kind.name + " finds " + std::to_string(pairs) +
                               " pairs of " + task.mesh.name + " instead of " +
                               std::to_string(task.pairs));
    if (frame < first_frames) continue;
    cell.extra = pairs - task.pairs;
    cell.times.push_back(time);
    cell.extractions.push_back(finder->extraction());
    spent += time;
  }
}

void runTask(const Task& task, const std::vector<MeshFinderKind>& kinds, const Wishes& wishes,
             Csv& csv) {
  for (const int threads : wishes.threads) {
    std::vector<Cell> cells;
    for (const MeshFinderKind& kind : kinds)
      if (isWished(wishes.peers, kind.name) && (task.second || !kind.two_groups_only))
        cells.push_back(Cell{kind});
    for (int round = 0; round < wishes.rounds; ++round)
      for (Cell& cell : cells) takeTurn(cell, task, threads, wishes.seconds / wishes.rounds);
    for (const Cell& cell : cells) {
      std::printf("%-24s %-12s %-32s %8d %10.3f %10.3f %10.3f %10zu %6zu\n", task.mesh.name.c_str(),
                  task.kind, cell.kind.name.c_str(), threads, median(cell.times),
                  *std::min_element(cell.times.begin(), cell.times.end()), median(cell.extractions),
                  task.pairs, cell.extra);
      std::fflush(stdout);
      csv.write(Row()
                    .add("mesh", task.mesh.name)
                    .add("kind", task.kind)
                    .add("boxes", task.boxes())
                    .add("peer", cell.kind.name)
                    .add("library", cell.kind.library)
                    .add("threads", threads)
                    .addTimes(cell.times)
                    .add("extract_ms", median(cell.extractions))
                    .add("pairs", task.pairs)
                    .add("extra_pairs", cell.extra)
                    .addMachine());
    }
  }
}

void run(const Wishes& wishes) {
  std::vector<MeshFinderKind> kinds;
  addSpaceFinders(kinds);
#ifdef BENCH_EMBREE
  addEmbreeFinders(kinds);
#endif
  for (const std::string& peer : wishes.peers)
    if (std::none_of(kinds.begin(), kinds.end(), [&](auto& kind) { return kind.name == peer; }))
      throw std::invalid_argument("no peer " + peer);
  Csv csv(wishes.csv);
  std::printf("%-24s %-12s %-32s %8s %10s %10s %10s %10s %6s\n", "mesh", "kind", "peer", "threads",
              "median ms", "least", "extract", "pairs", "extra");
  std::vector<Mesh> meshes;
  if (!wishes.directory.empty()) meshes = readMeshes(wishes.directory);
  for (const std::size_t side : wishes.made) meshes.push_back(madeCloth(side));
  if (meshes.empty()) throw std::invalid_argument("neither --data nor --made");
  for (const Mesh& mesh : meshes) {
    if (!isWished(wishes.meshes, mesh.name)) continue;
    runTask({mesh, "edge-edge", mesh.edges, nullptr, countPairs(mesh.edges, nullptr)}, kinds,
            wishes, csv);
    runTask(
        {mesh, "vertex-face", mesh.vertices, &mesh.faces, countPairs(mesh.vertices, &mesh.faces)},
        kinds, wishes, csv);
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program(
      "mesh-benchmark: edges of real meshes against edges, and their vertices against faces");
  program
      .add("--data", wishes.directory,
           "directory of the meshes: boxes (*.f64), or the Scalable-CCD data set")
      ->envname("ODE_PARALLEL_SAP_MESHES");
  program.add("--made", wishes.made, "sides of cloths made by a formula, for where there is none");
  program.add("--meshes", wishes.meshes, "names; default: all");
  program.add("--peers", wishes.peers, "default: all");
  program.add("--threads", wishes.threads);
  program.add("--seconds", wishes.seconds, "of frames in a cell");
  program.add("--rounds", wishes.rounds, "turns of each peer");
  program.add(wishes.csv);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
