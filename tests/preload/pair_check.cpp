// LD_PRELOAD=libpair-check.so:libode-parallel-sap-preload.so program
//
// Stands between any program with ODE and its spaces. Each call must report the pairs of the
// oracle (support/oracle.h): dSpaceCollide of a replaced space in their order, all others in any.
// Says at the end of how many calls and pairs that was true; the first wrong call ends the program.
//
// It is linked with ODE, so that ODE is in the process wherever the program gets it from.
#include <dlfcn.h>
#include <ode/ode.h>

#include <algorithm>
#include <cstdio>
#include <utility>
#include <vector>

#include "support/oracle.h"

namespace {

using Geoms = std::vector<dGeomID>;
using Reported = std::vector<std::pair<dGeomID, dGeomID>>;

bool checking = false;  // the oracle collides a space, too

struct Sums {
  unsigned long calls = 0, pairs = 0;
  ~Sums() { std::fprintf(stderr, "pair check: %lu calls, %lu pairs, all right\n", calls, pairs); }
} sums;

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

void collect(void* pairs, dGeomID a, dGeomID b) {
  static_cast<Reported*>(pairs)->emplace_back(a, b);
}

Geoms geomsIn(dSpaceID space) {
  Geoms geoms;
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) geoms.push_back(dSpaceGetGeom(space, i));
  return geoms;
}

void owe(dGeomID a, dGeomID b, Reported& owed) {
  if (sap_test::takesPart(a) && sap_test::takesPart(b) && sap_test::mayTouch(a, b))
    owed.emplace_back(a, b);
}

Reported asSet(Reported pairs) {
  for (auto& pair : pairs) pair = std::minmax(pair.first, pair.second);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

// Calls the program back if the pairs are right.
void handOn(const char* call, bool right, const Reported& pairs, std::size_t owed, void* data,
            dNearCallback* callback) {
  checking = false;
  if (!right) {
    std::fprintf(stderr, "pair check: %s number %lu: wrong pairs, %zu of %zu\n", call, sums.calls,
                 pairs.size(), owed);
    std::_Exit(1);
  }
  ++sums.calls;
  sums.pairs += pairs.size();
  for (const auto& pair : pairs) callback(data, pair.first, pair.second);
}

}  // namespace

extern "C" {

void dSpaceCollide(dSpaceID space, void* data, dNearCallback* callback) {
  static auto* const real = next<decltype(dSpaceCollide)>("dSpaceCollide");
  if (checking) return real(space, data, callback);
  Reported pairs, owed;
  real(space, &pairs, collect);
  checking = true;
  const Geoms geoms = geomsIn(space);
  for (std::size_t i = 0; i < geoms.size(); ++i)
    for (std::size_t j = i + 1; j < geoms.size(); ++j) owe(geoms[i], geoms[j], owed);
  const bool in_order = dSpaceGetClass(space) != dSimpleSpaceClass;  // which is left to ODE
  const bool right = in_order ? pairs == owed : asSet(pairs) == asSet(owed);
  handOn("dSpaceCollide", right, pairs, owed.size(), data, callback);
}

// The spaces of programs here are all of one sublevel.
void dSpaceCollide2(dGeomID a, dGeomID b, void* data, dNearCallback* callback) {
  static auto* const real = next<decltype(dSpaceCollide2)>("dSpaceCollide2");
  Reported pairs, owed;
  real(a, b, &pairs, collect);
  checking = true;
  const auto contents = [](dGeomID geom) {
    return dGeomIsSpace(geom) ? geomsIn(reinterpret_cast<dSpaceID>(geom)) : Geoms{geom};
  };
  const Geoms of_b = contents(b);
  for (const dGeomID first : contents(a))
    for (const dGeomID second : of_b) owe(first, second, owed);
  handOn("dSpaceCollide2", asSet(pairs) == asSet(owed), pairs, owed.size(), data, callback);
}
}
