// Random scenes in each of ODE's spaces and in ours: the pairs that each misses, invents or reports
// twice, and where it ends the program.
//
//     stock-spaces SCENES [COMMIT] > rows.csv
//
// plays so many scenes of each kind. Ends with 1 if ours was wrong anywhere, with 77 if dHashSpace
// missed nothing in the pile: that ODE has mended it.
#include <ode/ode.h>
#include <ode/version.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <vector>

#include "../support/bounds.h"
#include "../support/ode_errors.h"
#include "../support/oracle.h"
#include "../support/random.h"
#include "../support/recorder.h"
#include "../support/scenes.h"

namespace {

using namespace sap_test;

enum Extra { kPlanes = 1, kNested = 2, kAddedAgain = 4, kPile = 8 };

struct Kind {
  const char* name;
  double low[3], high[3];    // where geoms are, before some are put beside others
  double smallest, largest;  // sizes, log-uniform
  int extra = 0;
};

constexpr Kind boxed(const char* name, double low, double high, double smallest, double largest,
                     int extra = 0) {
  return {name, {low, low, low}, {high, high, high}, smallest, largest, extra};
}

const Kind kKinds[] = {
    boxed("around the origin", -3, 3, 0.1, 2),
    boxed("at 0.5 to 5", 0.5, 5, 0.1, 2),
    boxed("a pile that rests on z = 0", -3, 3, 0.3, 0.9, kPile),
    {"100 m below, x from 1 to 2", {1, 0, -101}, {2, 1, -99}, 0.3, 0.9},
    boxed("1e3 from the origin", 1e3, 1e3 + 6, 0.1, 2),
    boxed("1e6 from the origin", 1e6, 1e6 + 6, 0.1, 2),
    boxed("1e9 from the origin", 1e9, 1e9 + 6, 0.1, 2),
    boxed("tiny, at the origin", -3e-6, 3e-6, 1e-7, 2e-6),
    boxed("tiny, at 1", 1, 1 + 6e-6, 1e-7, 2e-6),
    boxed("huge", -3e6, 3e6, 1e5, 2e6),
    boxed("sizes of 1e-3 to 1e3", -3, 3, 1e-3, 1e3),
    boxed("with planes", -3, 3, 0.1, 2, kPlanes),
    boxed("in sub-spaces", -3, 3, 0.1, 2, kNested),
    boxed("some removed and added again", -3, 3, 0.1, 2, kAddedAgain),
};

// The same calls for each space, if the seed is the same.
class Scene {
 public:
  Scene(const StockSpace& space, const Kind& kind, std::uint64_t seed)
      : kind_(kind), random_(seed), outer_(space.create(nullptr)) {
    if (kind.extra & kNested) {
      for (int i = 0; i < 3; ++i)
        parts_.push_back(i == 1 ? dSimpleSpaceCreate(outer_)
                                : space.create(i == 2 ? parts_[0] : outer_));
    }
    const std::size_t count = 8 + random_.below(30);
    for (std::size_t i = 0; i < count; ++i) {
      add(kind.extra & kPlanes && i % 9 == 4 ? plane() : body());
      if (!isPlane(geoms_.back())) place(geoms_.back());
    }
  }

  void destroy() { dSpaceDestroy(outer_); }  // not what is locked since it aborted

  void change() {
    for (const dGeomID geom : geoms_) {
      if (isPlane(geom) || random_.chance(0.5)) continue;
      if (random_.chance(0.2)) {
        place(geom);
      } else {
        const dReal* at = dGeomGetPosition(geom);
        const double step = 0.1 * kind_.smallest;
        dGeomSetPosition(geom, at[0] + random_.between(-step, step), at[1], at[2] - step);
      }
    }
    for (int i = 0; i < 3 && kind_.extra & kAddedAgain; ++i) {
      const dGeomID geom = geoms_[random_.below(geoms_.size())];
      dSpaceRemove(outer_, geom);
      dSpaceAdd(outer_, geom);
    }
  }

  Pairs collide() const {
    Pairs got;
    dSpaceCollide(outer_, &got, recordGeoms);
    for (const dSpaceID part : parts_) dSpaceCollide(part, &got, recordGeoms);
    return got;
  }

  Pairs expected() const { return expectedPairs(geoms_); }

  bool touch(const Pair& pair) const {
    dContactGeom contact[4];
    return dCollide(geoms_[pair.first], geoms_[pair.second], 4, contact, sizeof *contact) > 0;
  }

 private:
  static bool isPlane(dGeomID geom) { return dGeomGetClass(geom) == dPlaneClass; }

  static void recordGeoms(void* pairs, dGeomID a, dGeomID b) {
    if (dGeomIsSpace(a) || dGeomIsSpace(b)) return dSpaceCollide2(a, b, pairs, recordGeoms);
    record(pairs, a, b);
  }

  void add(dGeomID geom) {
    setNumber(geom, geoms_.size());
    geoms_.push_back(geom);
    const bool in_outer = parts_.empty() || random_.chance(0.3);
    dSpaceAdd(in_outer ? outer_ : parts_[random_.below(parts_.size())], geom);
  }

  dReal size() {
    return real(kind_.smallest * std::pow(kind_.largest / kind_.smallest, random_.unit()));
  }

  dGeomID body() {
    const dReal a = size(), b = size(), c = size();
    const double shape = random_.unit();
    const dGeomID geom = shape < 0.4    ? dCreateBox(nullptr, a, a, a)
                         : shape < 0.7  ? dCreateBox(nullptr, a, b, c)
                         : shape < 0.85 ? dCreateSphere(nullptr, a / 2)
                                        : dCreateCapsule(nullptr, a / 4, a / 2);
    if (random_.chance(0.3)) {
      dMatrix3 turned;
      const dReal x = real(random_.gauss()), y = real(random_.gauss());
      dRFromAxisAndAngle(turned, x, y, 1, real(random_.between(0, 6)));
      dGeomSetRotation(geom, turned);
    }
    return geom;
  }

  dGeomID plane() {
    const dReal normals[][3] = {{1, 0, 0}, {0, 0, -1}, {0, 0, 1}, {real(0.6), 0, real(0.8)}};
    const dReal* normal = normals[random_.below(std::size(normals))];
    const dReal distance = real(random_.between(-2, 2));
    return dCreatePlane(nullptr, normal[0], normal[1], normal[2], distance);
  }

  // Anywhere, or beside a geom: the boxes touch, overlap or leave a gap.
  void place(dGeomID geom) {
    double at[3];
    for (int axis = 0; axis < 3; ++axis)
      at[axis] = random_.between(kind_.low[axis], kind_.high[axis]);
    const dGeomID other = geoms_[random_.below(geoms_.size())];
    const bool pile = kind_.extra & kPile;
    if (pile) at[2] = (boundsOf(geom)[5] - boundsOf(geom)[4]) / 2 - 1e-4;
    if (other != geom && !isPlane(other) && random_.chance(0.6)) {
      const Bounds mine = boundsOf(geom), its = boundsOf(other);
      const std::size_t axis = pile ? 2 : random_.below(3);
      const double gaps[] = {0, 0, 1e-4, -1e-4, -0.2, 0.01};
      for (std::size_t i = 0; i < 3; ++i) at[i] = its[2 * i] / 2 + its[2 * i + 1] / 2;
      const double extent = mine[2 * axis + 1] - mine[2 * axis] + its[2 * axis + 1] - its[2 * axis];
      const double sign = pile || random_.chance(0.5) ? 1 : -1;
      at[axis] += sign * extent * (0.5 + gaps[random_.below(std::size(gaps))]);
    }
    dGeomSetPosition(geom, real(at[0]), real(at[1]), real(at[2]));
  }

  const Kind& kind_;
  Random random_;
  const dSpaceID outer_;
  std::vector<dSpaceID> parts_;
  std::vector<dGeomID> geoms_;
};

// What becomes of many scenes of one kind in one space.
enum Column { pairs, missed, missed_contacts, invented, repeated, of_scenes };
constexpr const char* kColumns[] = {
    "pairs",          "missed",           "missed_contacts",  "invented",       "repeated",
    "scenes_missing", "scenes_inventing", "scenes_repeating", "scenes_aborting"};
using Tally = std::array<std::size_t, std::size(kColumns)>;

void count(const Scene& scene, Tally& tally) {
  Pairs got = asSet(scene.collide()), lost;
  const Pairs expected = asSet(scene.expected());  // after it: asks geoms for their bounds
  const auto end = std::unique(got.begin(), got.end());
  tally[repeated] += static_cast<std::size_t>(got.end() - end);
  got.erase(end, got.end());
  std::set_difference(expected.begin(), expected.end(), got.begin(), got.end(),
                      std::back_inserter(lost));
  tally[missed] += lost.size();
  for (const Pair& pair : lost) tally[missed_contacts] += scene.touch(pair);
  tally[invented] += got.size() + lost.size() - expected.size();
  tally[pairs] += expected.size();
}

void play(const StockSpace& space, const Kind& kind, std::uint64_t seed, Tally& tally) {
  const Tally before = tally;
  bool aborts = false;
  try {
    Scene scene(space, kind, seed);
    for (int frame = 0; frame < 3; ++frame) {
      if (frame > 0) scene.change();
      count(scene, tally);
    }
    scene.destroy();
  } catch (const OdeAssertion&) {
    aborts = true;
  }
  const bool happened[] = {tally[missed] > before[missed], tally[invented] > before[invented],
                           tally[repeated] > before[repeated], aborts};
  for (std::size_t i = 0; i < 4; ++i) tally[of_scenes + i] += happened[i];
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: %s SCENES [COMMIT] > rows.csv\n", argv[0]), 2;
  const std::size_t scenes = std::strtoul(argv[1], nullptr, 10);
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  throwOdeErrors();
  std::printf("space,scene,scenes");
  for (const char* column : kColumns) std::printf(",%s", column);
  std::printf(",ode,commit\n");
  bool ours_exact = true, hash_misses = false;
  std::vector<StockSpace> spaces(std::begin(kStockSpaces), std::end(kStockSpaces));
  spaces.push_back({"dParallelSAPSpace", dParallelSAPSpaceCreate});
  for (const Kind& kind : kKinds) {
    for (const StockSpace& space : spaces) {
      Tally tally = {};
      for (std::size_t seed = 0; seed < scenes; ++seed) play(space, kind, seed, tally);
      std::printf("%s,\"%s\",%zu", space.name, kind.name, scenes);
      for (const std::size_t number : tally) std::printf(",%zu", number);
      std::printf(",%s,%s\n", dODE_VERSION, argc > 2 ? argv[2] : "");
      if (space.create == dParallelSAPSpaceCreate)
        for (std::size_t i = 0; i < 4; ++i) ours_exact = ours_exact && !tally[of_scenes + i];
      if (space.create == dHashSpaceCreate && kind.extra == kPile) hash_misses = tally[missed] > 0;
    }
  }
  dCloseODE();
  if (!ours_exact) return std::fprintf(stderr, "dParallelSAPSpace was wrong\n"), 1;
  if (!hash_misses)
    return std::fprintf(stderr, "SKIPPED: dHashSpace misses nothing in ODE %s\n", dODE_VERSION), 77;
  return 0;
}
