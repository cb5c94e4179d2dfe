// Frames of the example's warehouse in ODE's spaces, here, and in other libraries' trees: a step's
// collide, lidars, a planner.
#include <stdexcept>

#include "program.h"
#include "warehouse_peers.h"

namespace bench {

std::map<std::string, CreateWarehouse>& warehousePeers() {
  static std::map<std::string, CreateWarehouse> peers;
  return peers;
}

namespace {

constexpr char one_line[] = "parallel-sap", batches[] = "parallel-sap:batches";
const std::map<std::string, std::string> spaces = {{batches, one_line},
                                                   {one_line, one_line},
                                                   {"dHashSpace", "hash"},
                                                   {"dSweepAndPruneSpace", "sap"},
                                                   {"dSimpleSpace", "simple"}};

struct Wishes {
  std::vector<int> shelves{3000, 30000};
  std::vector<int> threads{1};
  std::vector<std::string> peers{batches, one_line, "dHashSpace", "dSweepAndPruneSpace"};
  Timing timing;
};

struct Cell {
  std::string peer;
  scene::Plan plan;
  std::vector<double> times{};        // ms
  std::vector<scene::Work> frames{};  // the same
  std::vector<scene::Work> first{};   // of a turn, which all must find the same in
};

std::unique_ptr<scene::Warehouse> create(const Cell& cell) {
  const auto peer = warehousePeers().find(cell.peer);
  return peer == warehousePeers().end() ? std::make_unique<scene::Warehouse>(cell.plan)
                                        : peer->second(cell.plan);
}

std::vector<Cell> cellsOf(int shelves, const Wishes& wishes) {
  std::vector<Cell> cells;
  for (const std::string& peer : wishes.peers) {
    const auto space = spaces.find(peer);  // none: another library's
    scene::Plan plan{space == spaces.end() ? "simple" : space->second, shelves};
    for (const int threads : plan.space == one_line ? wishes.threads : std::vector<int>{1}) {
      plan.threads = threads;
      plan.ways.rays = plan.ways.overlaps = plan.ways.skip_static = peer == batches;
      cells.push_back({peer, plan});
    }
  }
  return cells;
}

void compare(const Cell& cell, const Cell& right) {
  for (std::size_t i = 0; i < std::min(cell.first.size(), right.first.size()); ++i)
    if (cell.first[i].contacts != right.first[i].contacts ||
        cell.first[i].hits != right.first[i].hits || cell.first[i].free != right.first[i].free)
      throw std::runtime_error("wrong: " + cell.peer + " finds other than " + right.peer);
}

double stage(const std::vector<scene::Work>& frames, int number) {
  std::vector<double> times;
  for (const scene::Work& work : frames) times.push_back(work.ms[static_cast<std::size_t>(number)]);
  return median(times);
}

void run(int shelves, const Wishes& wishes, Csv& csv) {
  std::vector<Cell> cells = cellsOf(shelves, wishes);
  for (int round = 0; round < wishes.timing.rounds; ++round)
    for (Cell& cell : cells) {
      const std::unique_ptr<scene::Warehouse> warehouse = create(cell);
      cell.first.clear();
      timeFrames(cell.times, 2, wishes.timing, [&] {
        cell.first.push_back(warehouse->frame());
        return cell.first.back().total();
      });
      cell.frames.insert(cell.frames.end(), cell.first.begin() + 2, cell.first.end());
      compare(cell, cells[0]);
    }
  for (const Cell& cell : cells) {
    const scene::Work& work = cell.first.front();
    csv.write(Row()
                  .add("n", shelves)
                  .add("peer", cell.peer)
                  .add("threads", cell.plan.threads)
                  .addTimes(cell.times)
                  .add("collide_ms", stage(cell.frames, scene::Work::Collide))
                  .add("lidar_ms", stage(cell.frames, scene::Work::Lidar))
                  .add("planner_ms", stage(cell.frames, scene::Work::Planner))
                  .add("pairs", static_cast<std::size_t>(work.pairs))
                  .add("contacts", work.contacts)
                  .add("hits", work.hits)
                  .add("free", work.free));
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  std::vector<std::string> names;
  for (const auto& space : bench::spaces) names.push_back(space.first);
  for (const auto& peer : bench::warehousePeers()) {
    names.push_back(peer.first);
    wishes.peers.push_back(peer.first);
  }
  bench::Program program("warehouse-benchmark: a step's collide, lidars and a planner");
  program.add_option("--sizes", wishes.shelves, "shelves: static boxes")->delimiter(',');
  program.add_option("--threads", wishes.threads, "of our space; 0: as many as it takes by itself")
      ->delimiter(',');
  program.add_option("--peers", wishes.peers)->delimiter(',')->check(CLI::IsMember(names));
  program.addTiming(wishes.timing);
  return program.run(argc, argv, [&] {
    bench::Csv csv(wishes.timing.csv);
    for (const int shelves : wishes.shelves) bench::run(shelves, wishes, csv);
  });
}
