// Scenes of which little moves: what a frame costs against one in which everything does, with all
// pairs reported, with those at rest left out, and with a tolerance.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <string>
#include <vector>

#include "program.h"
#include "random.h"
#include "scenes.h"

namespace bench {
namespace {

constexpr double step = 0.01;  // how far, at most, in widths of a box

enum Movers { kAll, kSome, kOthersEachFrame, kNone };
enum Flags {
  kBodies = 1,  // those that move are on bodies
  kAsleep = 2,  // the others are on disabled bodies
  kSkipStatic = 4,
  kSkipAsleep = 8,
  kNotified = 16  // dParallelSAPSpaceSetNotified, with nothing to announce
};

// What moves, what the others are, and what is asked of the space.
struct Setting {
  const char* name;
  Movers movers;
  int flags = 0;
  double tolerance = 0;

  bool has(Flags flag) const { return flags & flag; }
  // Of `n` geoms, where `some` is what the user asked for.
  std::size_t moving(std::size_t n, std::size_t some) const {
    return movers == kAll ? n : movers == kNone ? 0 : some;
  }
};
constexpr Setting settings[] = {
    {"all-move", kAll},
    {"some-move", kSome},
    {"some-move-notified", kSome, kNotified},
    {"none-move", kNone, kBodies | kAsleep},
    {"none-move-notified", kNone, kBodies | kAsleep | kNotified},
    {"others-move", kOthersEachFrame},
    {"some-awake", kSome, kBodies | kAsleep},
    {"skip-asleep", kSome, kBodies | kAsleep | kSkipStatic | kSkipAsleep},
    {"skip-asleep-notified", kSome, kBodies | kAsleep | kSkipStatic | kSkipAsleep | kNotified},
    {"skip-static", kSome, kBodies | kSkipStatic},
    {"tolerance-0.2", kAll, 0, 0.2},
    {"tolerance-0.002", kAll, 0, 0.002},
};

struct Wishes {
  std::vector<std::size_t> sizes{400000};
  std::vector<std::string> names;
  double moving = 0.01;  // part of the geoms, or their number if above 1
  int threads = 1;
  Timing timing{2, 2, 0, {}};
};

// Unit cubes in a space, each with a place of its own around which it moves.
class MovingCubes {
 public:
  // Takes the space over.
  explicit MovingCubes(dSpaceID space) : space_(space), world_(dWorldCreate()) {}
  ~MovingCubes() {
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }
  MovingCubes(const MovingCubes&) = delete;
  MovingCubes& operator=(const MovingCubes&) = delete;

  // Adds a cube at the centre of `box`, on a body of its own if so wished.
  dGeomID add(const sap_test::Box& box, bool on_body) {
    const dGeomID geom = dCreateBox(space_, 1, 1, 1);
    if (on_body) dGeomSetBody(geom, dBodyCreate(world_));
    geoms_.push_back(geom);
    for (int axis = 0; axis < 3; ++axis)
      places_.push_back(static_cast<dReal>((box.low[axis] + box.high[axis]) / 2));
    const dReal* const at = &places_[places_.size() - 3];
    dGeomSetPosition(geom, at[0], at[1], at[2]);
    return geom;
  }
  // Puts a cube at a random place, on each axis up to `reach` from its own.
  void move(std::size_t cube, double reach) {
    dReal at[3];
    for (std::size_t axis = 0; axis < 3; ++axis)
      at[axis] = places_[3 * cube + axis] + static_cast<dReal>(random_.between(-reach, reach));
    dGeomSetPosition(geoms_[cube], at[0], at[1], at[2]);
  }
  std::size_t any() { return random_.below(geoms_.size()); }

  std::size_t size() const { return geoms_.size(); }
  dSpaceID space() const { return space_; }

 private:
  dSpaceID space_;
  dWorldID world_;
  std::vector<dGeomID> geoms_;
  std::vector<dReal> places_;
  sap_test::Random random_{3};
};

class Scene {
 public:
  Scene(const Setting& setting, std::size_t n, std::size_t movers, const Wishes& wishes)
      : setting_(setting), movers_(movers), cubes_(dParallelSAPSpaceCreate(nullptr)) {
    const dSpaceID space = cubes_.space();
    dParallelSAPSpaceSetNumThreads(space, wishes.threads);
    dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
    dParallelSAPSpaceSetSkipStatic(space, setting.has(kSkipStatic));
    dParallelSAPSpaceSetSkipAsleep(space, setting.has(kSkipAsleep));
    dParallelSAPSpaceSetTolerance(space, static_cast<dReal>(setting.tolerance));
    dParallelSAPSpaceSetNotified(space, setting.has(kNotified));
    for (const sap_test::Box& box : sap_test::denseCube(n, 1)) {
      const bool moves = setting.movers == kAll || cubes_.size() < movers;
      const dGeomID geom = cubes_.add(box, setting.has(moves ? kBodies : kAsleep));
      if (!moves && setting.has(kAsleep)) dBodyDisable(dGeomGetBody(geom));
    }
  }

  double next() {
    const std::size_t moves = setting_.moving(cubes_.size(), movers_);
    for (std::size_t i = 0; i < moves; ++i)
      cubes_.move(setting_.movers == kOthersEachFrame ? cubes_.any() : i, step);
    pairs_ = 0;
    const Stopwatch clock;
    dSpaceCollide(cubes_.space(), &pairs_, countPair);
    return clock.milliseconds();
  }
  std::size_t pairs() const { return pairs_; }

 private:
  const Setting& setting_;
  const std::size_t movers_;
  MovingCubes cubes_;
  std::size_t pairs_ = 0;
};

struct Cell {
  const Setting& setting;
  std::vector<double> times{};
  std::size_t pairs = 0;
};

void run(const Wishes& wishes) {
  Csv csv(wishes.timing.csv);
  for (const std::size_t n : wishes.sizes) {
    const std::size_t movers = static_cast<std::size_t>(
        wishes.moving > 1 ? wishes.moving : wishes.moving * static_cast<double>(n));
    std::vector<Cell> cells;
    for (const Setting& setting : settings)
      if (wishes.names.empty() || &setting == settings ||
          std::find(wishes.names.begin(), wishes.names.end(), setting.name) != wishes.names.end())
        cells.push_back({setting});
    for (int round = 0; round < wishes.timing.rounds; ++round)
      for (Cell& cell : cells) {
        Scene scene(cell.setting, n, movers, wishes);
        timeFrames(cell.times, 4, wishes.timing, [&] { return scene.next(); });
        cell.pairs = scene.pairs();
      }
    for (const Cell& cell : cells)
      csv.write(Row()
                    .add("setting", cell.setting.name)
                    .add("n", n)
                    .add("movers", cell.setting.moving(n, movers))
                    .add("threads", wishes.threads)
                    .addTimes(cell.times)
                    // The mean, since now and then a frame tidies up for many.
                    .add("ratio", mean(cell.times) / mean(cells[0].times))
                    .add("pairs", cell.pairs));
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program("rest-benchmark: what moves, against all moving");
  program.add("--sizes", wishes.sizes, "geoms");
  std::vector<std::string> names;
  for (const bench::Setting& setting : bench::settings) names.push_back(setting.name);
  program.add("--settings", wishes.names, "default: all")->check(CLI::IsMember(names));
  program.add("--moving", wishes.moving, "part of the geoms that moves; above 1: their number")
      ->check(CLI::PositiveNumber);
  program.add("--threads", wishes.threads)->check(CLI::PositiveNumber);
  program.add(wishes.timing);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
