// A program that knows ODE only, for runs with and without the preload library: what it prints must
// be the same. It makes every kind of space, asks them what programs ask, through the C functions
// and the C++ wrappers, and prints each frame's pairs as a sorted list.
#include <ode/ode.h>
#include <ode/odecpp.h>
#include <ode/odecpp_collision.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

namespace {

using Pairs = std::vector<std::pair<int, int>>;

int number(dGeomID geom) {
  return static_cast<int>(reinterpret_cast<std::size_t>(dGeomGetData(geom)));
}

void add(void* data, dGeomID a, dGeomID b) {
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) return dSpaceCollide2(a, b, data, add);
  const std::pair<int, int> pair = std::minmax(number(a), number(b));
  static_cast<Pairs*>(data)->push_back(pair);
}

void printPairs(const char* name, dSpaceID space) {
  Pairs pairs;
  dSpaceCollide(space, &pairs, add);
  std::sort(pairs.begin(), pairs.end());
  std::printf("%s: class %d, %d geoms, %zu pairs:", name, dSpaceGetClass(space),
              dSpaceGetNumGeoms(space), pairs.size());
  for (const auto& pair : pairs) std::printf(" %d-%d", pair.first, pair.second);
  std::printf("\n");
}

// Boxes away from the coordinate planes, where every stock space finds all pairs.
void fill(dSpaceID space, int count) {
  for (int i = 0; i < count; ++i) {
    const dGeomID box = dCreateBox(space, 1, 1, 1);
    dGeomSetPosition(box, 20 + 0.7 * (i % 7), 20 + 0.8 * (i / 7 % 7), 20 + 0.9 * (i / 49));
    dGeomSetData(box, reinterpret_cast<void*>(static_cast<std::size_t>(i)));
  }
}

void exercise(const char* name, dSpaceID space) {
  std::printf("%s: class %d, geom class %d, is a space: %d, cleanup %d, sublevel %d\n", name,
              dSpaceGetClass(space), dGeomGetClass(reinterpret_cast<dGeomID>(space)),
              dGeomIsSpace(reinterpret_cast<dGeomID>(space)), dSpaceGetCleanup(space),
              dSpaceGetSublevel(space));
  fill(space, 60);
  printPairs(name, space);
  dSpaceID inner = dSimpleSpaceCreate(space);
  fill(inner, 5);
  printPairs(name, space);
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

}  // namespace

#if defined(main)  // a plug-in
extern "C" int run();
#endif

int main() {
  dInitODE2(0);
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
    printPairs("wrapped", wrapped.id());
  }
  for (const dSpaceID space : spaces) dSpaceDestroy(space);
  dCloseODE();
  return 0;
}
