// Programs that know ODE only, for runs with and without the preload library, by argument:
//
//     stock               makes every kind of space and asks them what programs ask, through the C
//                         functions and the C++ wrappers
//     first               relies on the first argument of its callback
//     silent              changes geoms and bodies in all ways of which ODE tells no space
//     account [collide]   does what preload.sh knows the numbers of
#include <ode/ode.h>
#include <ode/odecpp.h>
#include <ode/odecpp_collision.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

dReal real(double value) {
  return static_cast<dReal>(value);
}

dGeomID asGeom(dSpaceID space) {
  return reinterpret_cast<dGeomID>(space);
}

dGeomID number(dGeomID geom, std::size_t n) {
  dGeomSetData(geom, reinterpret_cast<void*>(n));
  return geom;
}

void add(void* data, dGeomID a, dGeomID b) {
  const auto number_of = [](dGeomID geom) {
    return reinterpret_cast<std::size_t>(dGeomGetData(geom));
  };
  static_cast<Pairs*>(data)->push_back({number_of(a), number_of(b)});
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) dSpaceCollide2(a, b, data, add);
}

// Sorted; each in the order in which it was passed, or ascending.
void printPairs(const char* name, int of, dSpaceID space, bool as_passed = false) {
  Pairs pairs;
  dSpaceCollide(space, &pairs, add);
  for (auto& pair : pairs)
    if (!as_passed && pair.first > pair.second) std::swap(pair.first, pair.second);
  std::sort(pairs.begin(), pairs.end());
  std::printf("%s %d: %zu pairs:", name, of, pairs.size());
  for (const auto& pair : pairs) std::printf(" %zu-%zu", pair.first, pair.second);
  std::printf("\n");
}

// Boxes away from the coordinate planes, where every stock space finds all pairs.
void fill(dSpaceID space, int count) {
  for (int i = 0; i < count; ++i)
    dGeomSetPosition(number(dCreateBox(space, 1, 1, 1), std::size_t(i)), real(20 + 0.7 * (i % 7)),
                     real(20 + 0.8 * (i / 7 % 7)), real(20 + 0.9 * (i / 49)));
}

void exercise(const char* name, dSpaceID space) {
  std::printf("%s: class %d, geom class %d, is a space: %d, cleanup %d, sublevel %d\n", name,
              dSpaceGetClass(space), dGeomGetClass(asGeom(space)), dGeomIsSpace(asGeom(space)),
              dSpaceGetCleanup(space), dSpaceGetSublevel(space));
  fill(space, 60);
  printPairs(name, dSpaceGetNumGeoms(space), space);
  const dSpaceID inner = dSimpleSpaceCreate(space);
  number(asGeom(inner), 99);
  fill(inner, 5);
  printPairs(name, dSpaceGetNumGeoms(space), space);
}

void exerciseLevels(dSpaceID space) {
  int least = 0, most = 0;
  dHashSpaceGetLevels(space, &least, &most);
  std::printf("levels %d to %d", least, most);
  dHashSpaceSetLevels(space, -5, 7);
  dHashSpaceGetLevels(space, &least, nullptr);
  dHashSpaceGetLevels(space, nullptr, &most);
  std::printf(", then %d to %d\n", least, most);
}

void stock() {
  const dVector3 center = {20, 20, 20, 0}, extents = {20, 20, 20, 0};
  dSpaceID spaces[] = {dSimpleSpaceCreate(0), dHashSpaceCreate(0),
                       dSweepAndPruneSpaceCreate(0, dSAP_AXES_ZXY),
                       dQuadTreeSpaceCreate(0, center, extents, 4)};
  const char* const names[] = {"simple", "hash", "sap", "quadtree"};
  exerciseLevels(spaces[1]);
  for (int i = 0; i < 4; ++i) exercise(names[i], spaces[i]);
  {
    dHashSpace wrapped;
    wrapped.setLevels(-2, 3);
    std::printf("wrapped: class %d, ", dSpaceGetClass(wrapped.id()));
    exerciseLevels(wrapped.id());
    fill(wrapped.id(), 30);
    printPairs("wrapped", 30, wrapped.id());
  }
  for (const dSpaceID space : spaces) dSpaceDestroy(space);
}

void exerciseFirst(dSpaceID (*create)(dSpaceID), bool sets_levels) {
  static std::mt19937 engine(5);
  const auto uniform = [](double least, double most) {
    return real(least + (most - least) * (static_cast<double>(engine()) / 4294967296.0));
  };
  const auto place = [&](dGeomID geom) {  // far from where dHashSpace misses pairs
    const dReal at[] = {uniform(1000, 1012), uniform(1000, 1012), uniform(1000, 1012)};
    dGeomSetPosition(geom, at[0], at[1], at[2]);
  };
  const dSpaceID space = create(nullptr), inner = create(space);
  if (sets_levels) dHashSpaceSetLevels(space, -1, 2);
  std::size_t numbers = 0;
  number(asGeom(inner), ++numbers);
  std::vector<dGeomID> geoms;
  for (int frame = 0; frame < 40; ++frame) {
    for (int i = 0; i < 4; ++i) {
      const dReal size = std::exp2(uniform(-3, 4));
      geoms.push_back(number(dCreateBox(i ? space : inner, size, size / 2, size / 3), ++numbers));
      place(geoms.back());
    }
    if (frame == 20) geoms.push_back(number(dCreateBox(space, 5000, 5000, 1), ++numbers));
    for (int i = 0; i < frame % 3 * 9; ++i) {
      const dGeomID moved = geoms[engine() % geoms.size()];
      if (i % 5 == 4) {
        const dSpaceID home = dGeomGetSpace(moved);
        dSpaceRemove(home, moved);
        dSpaceAdd(home, moved);
      }
      place(moved);
    }
    printPairs("frame", frame, space, true);
  }
  dSpaceDestroy(space);
}

void first() {
  exerciseFirst(dSimpleSpaceCreate, false);
  exerciseFirst(dHashSpaceCreate, false);
  exerciseFirst(dHashSpaceCreate, true);
}

// Changes a box and, two frames later, changes it back.
void change(int way, dGeomID geom, bool back) {
  const dBodyID body = dGeomGetBody(geom);
  switch (way) {
    case 0:
      return dGeomSetCategoryBits(geom, back ? ~0ul : 0);
    case 1:
      return dGeomSetCollideBits(geom, back ? ~0ul : 0);
    case 2:
      return (back ? dGeomEnable : dGeomDisable)(geom);
    case 3:
      return back ? void() : dGeomSetBody(geom, nullptr);
    case 4:
      return back ? void() : dBodyDestroy(body);
    case 5:
      return (back ? dBodyDisable : dBodyEnable)(body);
    case 6:
      return back ? dBodyDisable(body) : dBodySetAutoDisableFlag(body, 0);
    default:
      return back ? dBodyDisable(body) : dBodySetAutoDisableDefaults(body);
  }
}

// In a scene whose other geoms stand still.
void silent() {
  constexpr std::size_t boxes = 200, first_asleep = 55;
  const dWorldID world = dWorldCreate(), other_world = dWorldCreate();
  const dSpaceID space = dHashSpaceCreate(0);
  std::vector<dGeomID> geoms;
  for (std::size_t i = 0; i < boxes; ++i) {
    // Two of one body, which make no pair until it is gone.
    const dBodyID body =
        i % 10 == 1 ? dGeomGetBody(geoms.back()) : dBodyCreate(i < boxes / 2 ? world : other_world);
    geoms.push_back(number(dCreateBox(space, 1, 1, 1), i));
    dGeomSetBody(geoms[i], body);
    if (i % 10 == 1)
      dGeomSetOffsetPosition(geoms[i], real(0.75), 0, 0);
    else
      dGeomSetPosition(geoms[i], real(0.75 * static_cast<double>(i)), 0, 0);
    if (i >= first_asleep && i < boxes / 2) dBodyDisable(body);
  }
  // Either bits of theirs decide alone.
  dGeomSetCollideBits(geoms[10], 0);
  dGeomSetCategoryBits(geoms[20], 0);
  for (int frame = 0; frame < 3; ++frame) printPairs("before", frame, space);
  for (int way = 0; way < 8; ++way) {
    const dGeomID geom = geoms[std::size_t(10 * way + 10)];
    change(way, geom, false);
    printPairs("changed", way, space);
    printPairs("still", way, space);
    if (dGeomGetBody(geom)) change(way, geom, true);
    printPairs("back", way, space);
  }
  dWorldDestroy(other_world);
  printPairs("world", 0, space);
  // Triangles within a sub-space change far from all else, and then one of the others moves.
  const float near[] = {-99, 0, 0, -98, 0, 0, -99, 1, 0},
              far[] = {-199, 0, 0, -198, 0, 0, -199, 1, 0};
  const dTriIndex indices[] = {0, 1, 2};
  const dTriMeshDataID data[] = {dGeomTriMeshDataCreate(), dGeomTriMeshDataCreate()};
  for (int i = 0; i < 2; ++i)
    dGeomTriMeshDataBuildSingle(data[i], i ? far : near, 3 * sizeof(float), 3, indices, 3,
                                3 * sizeof(dTriIndex));
  const dGeomID mesh = dCreateTriMesh(dHashSpaceCreate(space), data[0], 0, 0, 0);
  printPairs("mesh", 0, space);
  dGeomTriMeshSetData(mesh, data[1]);
  printPairs("mesh", 1, space);
  dGeomSetPosition(geoms[5], 0, 100, 0);
  printPairs("mesh", 2, space);
  dSpaceDestroy(space);
  for (const dTriMeshDataID each : data) dGeomTriMeshDataDestroy(each);
  dWorldDestroy(world);
}

// Spheres each of which touches the next.
void row(dSpaceID space, int count, double x, dWorldID world, int asleep) {
  for (int i = 0; i < count; ++i) {
    const dGeomID sphere = dCreateSphere(space, real(0.6));
    if (i < asleep) {
      dGeomSetBody(sphere, dBodyCreate(world));
      dBodyDisable(dGeomGetBody(sphere));
    }
    dGeomSetPosition(sphere, real(x + i), 0, 0);
  }
}

// Two hash spaces with 201 spheres in a row, the first 100 on sleeping bodies, and an oblique plane
// that all are clear of; five dSpaceCollide of each, with a callback that takes its time or calls
// dCollide; one dSpaceCollide2 of each with a group of 150 geoms. One is left at the end.
void account(bool collides) {
  const auto waste = [](void*, dGeomID, dGeomID) {
    std::this_thread::sleep_for(std::chrono::microseconds(20));
  };
  const auto collide = [](void*, dGeomID a, dGeomID b) {
    dContactGeom contacts[4];
    dCollide(a, b, 4, contacts, sizeof contacts[0]);
  };
  const dWorldID world = dWorldCreate();
  for (const bool is_left : {false, true}) {
    const dSpaceID space = dHashSpaceCreate(0), group = dSimpleSpaceCreate(0);
    row(space, 201, 0, world, 100);
    dCreatePlane(space, 1, 1, 1, -100);
    for (int i = 0; i < 5; ++i)
      collides ? dSpaceCollide(space, nullptr, collide) : dSpaceCollide(space, nullptr, waste);
    row(group, 150, 1000, nullptr, 0);
    dSpaceCollide2(asGeom(space), asGeom(group), nullptr, [](void*, dGeomID, dGeomID) {});
    dSpaceDestroy(group);
    if (!is_left) dSpaceDestroy(space);
  }
}

}  // namespace

#if defined(main)  // a plug-in
extern "C" int run(int argc, char** argv);
#endif

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "stock";
  dInitODE2(0);
  if (what == "account") return account(argc > 2), 0;  // which leaves a space
  (what == "first" ? first : what == "silent" ? silent : stock)();
  dCloseODE();
  return 0;
}
