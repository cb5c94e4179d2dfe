// A program that relies on the first argument of its callback: prints each frame's pairs, sorted,
// but each in the order in which it was passed.
#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <random>
#include <utility>
#include <vector>

namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

std::mt19937 engine(5);

dReal uniform(double least, double most) {
  return static_cast<dReal>(least +
                            (most - least) * (static_cast<double>(engine()) / 4294967296.0));
}

std::size_t number(dGeomID geom) {
  return reinterpret_cast<std::size_t>(dGeomGetData(geom));
}

void add(void* data, dGeomID a, dGeomID b) {
  static_cast<Pairs*>(data)->push_back({number(a), number(b)});
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) dSpaceCollide2(a, b, data, add);
}

// Far from where dHashSpace misses pairs.
void place(dGeomID geom) {
  dGeomSetPosition(geom, uniform(1000, 1012), uniform(1000, 1012), uniform(1000, 1012));
}

void exercise(dSpaceID (*create)(dSpaceID), bool sets_levels) {
  const dSpaceID space = create(nullptr), inner = create(space);
  if (sets_levels) dHashSpaceSetLevels(space, -1, 2);
  std::size_t numbers = 0;
  dGeomSetData(reinterpret_cast<dGeomID>(inner), reinterpret_cast<void*>(++numbers));
  std::vector<dGeomID> geoms;
  for (int frame = 0; frame < 40; ++frame) {
    for (int i = 0; i < 4; ++i) {
      const dReal size = std::exp2(uniform(-3, 4));
      geoms.push_back(dCreateBox(i ? space : inner, size, size / 2, size / 3));
      dGeomSetData(geoms.back(), reinterpret_cast<void*>(++numbers));
      place(geoms.back());
    }
    if (frame == 20) {
      geoms.push_back(dCreateBox(space, 5000, 5000, 1));
      dGeomSetData(geoms.back(), reinterpret_cast<void*>(++numbers));
    }
    for (int i = 0; i < frame % 3 * 9; ++i) {
      const dGeomID moved = geoms[engine() % geoms.size()];
      if (i % 5 == 4) {
        const dSpaceID home = dGeomGetSpace(moved);
        dSpaceRemove(home, moved);
        dSpaceAdd(home, moved);
      }
      place(moved);
    }
    Pairs pairs;
    dSpaceCollide(space, &pairs, add);
    std::sort(pairs.begin(), pairs.end());
    for (const auto& pair : pairs) std::printf(" %zu,%zu", pair.first, pair.second);
    std::printf(" frame %d\n", frame);
  }
  dSpaceDestroy(space);
}

}  // namespace

int main() {
  dInitODE2(0);
  exercise(dSimpleSpaceCreate, false);
  exercise(dHashSpaceCreate, false);
  exercise(dHashSpaceCreate, true);
  dCloseODE();
}
