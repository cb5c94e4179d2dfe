// The narrow phase with pairs that are certainly apart left out, and with every pair given to
// dCollide: boxes of one shape, poured between walls and left alone for a while. The two take turns
// on the same bodies, a frame each, and must find the same number of contacts.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "csv.h"
#include "program.h"
#include "random.h"

namespace bench {
namespace {

struct Wishes {
  CsvFile csv;
  std::size_t boxes = 10000;
  std::vector<double> sides{1, 1, 1};
  std::vector<int> steps{0, 50, 200};  // of a fiftieth of a second, after which it is measured
  std::vector<int> threads{1};
  int flags = 8;
  int frames = 100;
  std::string only;  // "left-out" or "collided": one of both, for a profiler
};

enum Way { collided, left_out };
constexpr const char* names[] = {"collided", "left-out"};

void countContacts(void* contacts, dGeomID, dGeomID, const dContactGeom*, int count) {
  *static_cast<std::size_t*>(contacts) += static_cast<std::size_t>(count);
}

class Pour {
 public:
  explicit Pour(const Wishes& wishes) : wishes_(wishes), world_(dWorldCreate()) {
    dWorldSetGravity(world_, 0, 0, dReal(-9.81));
    dWorldSetQuickStepNumIterations(world_, 10);
    for (const Way way : {collided, left_out}) {
      setenv("ODE_PARALLEL_SAP_TEST_APART", way == left_out ? "1" : "0", 1);
      spaces_[way] = dParallelSAPSpaceCreate(nullptr);
    }
    const double spacing = 1.28 * std::cbrt(wishes.sides[0] * wishes.sides[1] * wishes.sides[2]);
    const double wide = std::floor(std::sqrt(static_cast<double>(wishes.boxes) / 25)) + 1;
    for (const dSpaceID space : spaces_) addWalls(space, static_cast<dReal>(wide * spacing / 2));
    sap_test::Random random(1);
    for (std::size_t i = 0; i < wishes.boxes; ++i) {
      const double number = static_cast<double>(i), row = std::floor(number / wide);
      const auto at = [&](double place) {
        return static_cast<dReal>((place + 0.5 + 0.1 * random.unit() - wide / 2) * spacing);
      };
      addBox(random, at(number - row * wide), at(std::fmod(row, wide)),
             static_cast<dReal>((std::floor(row / wide) + 1) * 1.2 * spacing));
    }
  }
  ~Pour() {
    for (const dSpaceID space : spaces_) dSpaceDestroy(space);
    dJointGroupDestroy(joints_);
    dWorldDestroy(world_);
  }
  Pour(const Pour&) = delete;
  Pour& operator=(const Pour&) = delete;

  void stepTo(int step) {
    dParallelSAPSpaceSetNumThreads(spaces_[left_out], 0);
    for (; step_ < step; ++step_) {
      const dParallelSAPContactCallbacks callbacks = {joinAll, nullptr, nullptr, nullptr};
      dParallelSAPSpaceCollideContacts(spaces_[left_out], this, 8, &callbacks);
      dWorldQuickStep(world_, dReal(0.02));
      dJointGroupEmpty(joints_);
    }
  }
  dParallelSAPStats collide(Way way, int threads) {
    const dParallelSAPContactCallbacks callbacks = {countContacts, nullptr, nullptr, nullptr};
    std::size_t contacts = 0;
    dParallelSAPSpaceSetNumThreads(spaces_[way], threads);
    dParallelSAPSpaceCollideContacts(spaces_[way], &contacts, wishes_.flags, &callbacks);
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(spaces_[way], &stats);
    return stats;
  }

 private:
  static void addWalls(dSpaceID space, dReal far) {
    dCreatePlane(space, 0, 0, 1, 0);
    for (const dReal side : {dReal(-1), dReal(1)}) {
      dCreatePlane(space, side, 0, 0, -far);
      dCreatePlane(space, 0, side, 0, -far);
    }
  }
  void addBox(sap_test::Random& random, dReal x, dReal y, dReal z) {
    const dReal side[] = {static_cast<dReal>(wishes_.sides[0]),
                          static_cast<dReal>(wishes_.sides[1]),
                          static_cast<dReal>(wishes_.sides[2])};
    const dBodyID body = dBodyCreate(world_);
    dMass mass;
    dMassSetBox(&mass, 1, side[0], side[1], side[2]);
    dBodySetMass(body, &mass);
    dBodySetPosition(body, x, y, z);
    dQuaternion turn;
    for (dReal& number : turn) number = static_cast<dReal>(random.gauss());
    dBodySetQuaternion(body, turn);
    for (const dSpaceID space : spaces_)
      dGeomSetBody(dCreateBox(space, side[0], side[1], side[2]), body);
  }
  static void joinAll(void* pour, dGeomID o1, dGeomID o2, const dContactGeom* found, int count) {
    Pour& self = *static_cast<Pour*>(pour);
    for (int i = 0; i < count; ++i) {
      dContact contact = {};
      contact.surface.mode = dContactApprox1;
      contact.surface.mu = dReal(0.8);
      contact.geom = found[i];
      dJointAttach(dJointCreateContact(self.world_, self.joints_, &contact), dGeomGetBody(o1),
                   dGeomGetBody(o2));
    }
  }

  const Wishes& wishes_;
  dWorldID world_;
  dJointGroupID joints_ = dJointGroupCreate(0);
  dSpaceID spaces_[2];
  int step_ = 0;
};

void measure(Pour& pour, int step, int threads, const Wishes& wishes, Csv& csv) {
  std::vector<double> times[2];
  dParallelSAPStats last[2] = {};
  for (int frame = -2; frame < wishes.frames; ++frame)  // the first are not timed
    for (const Way way : {collided, left_out}) {
      if (!wishes.only.empty() && wishes.only != names[way]) continue;
      last[way] = pour.collide(way, threads);
      if (frame >= 0) times[way].push_back(last[way].narrow_ms);
    }
  if (!wishes.only.empty()) return;
  if (last[collided].contacts != last[left_out].contacts)
    throw std::runtime_error("the contacts differ");
  const double with = median(times[left_out]), without = median(times[collided]);
  std::printf("%5d %7d %8llu %8llu %8llu %11.3f %11.3f %6.2f\n", step, threads,
              last[left_out].pairs, last[left_out].apart, last[left_out].contacts, without, with,
              without / with);
  std::fflush(stdout);
  csv.write(Row()
                .add("boxes", wishes.boxes)
                .add("length", wishes.sides[2] / wishes.sides[0])
                .add("step", static_cast<std::size_t>(step))
                .add("threads", threads)
                .add("pairs", static_cast<std::size_t>(last[left_out].pairs))
                .add("apart", static_cast<std::size_t>(last[left_out].apart))
                .add("contacts", static_cast<std::size_t>(last[left_out].contacts))
                .add("collided_ms", without)
                .add("left_out_ms", with)
                .addMachine());
}

void run(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%5s %7s %8s %8s %8s %11s %11s %6s\n", "step", "threads", "pairs", "apart",
              "contacts", "collided ms", "left out ms", "gain");
  Pour pour(wishes);
  for (const int step : wishes.steps) {
    pour.stepTo(step);
    for (const int threads : wishes.threads) measure(pour, step, threads, wishes, csv);
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program(
      "apart-benchmark: the narrow phase with and without what is certainly apart");
  program.add("--boxes", wishes.boxes)->check(CLI::PositiveNumber);
  program.add("--sides", wishes.sides, "three lengths")->expected(3);
  program.add("--steps", wishes.steps, "after which it is measured, ascending");
  program.add("--threads", wishes.threads)->check(CLI::PositiveNumber);
  program.add("--flags", wishes.flags, "of dCollide");
  program.add("--frames", wishes.frames, "that are timed, of each way");
  program.add("--only", wishes.only)->check(CLI::IsMember({"collided", "left-out"}));
  program.add(wishes.csv);
  return program.run(argc, argv, [&] {
    dAllocateODEDataForThread(dAllocateMaskAll);
    bench::run(wishes);
  });
}
