// LD_PRELOAD=libpair-recorder.so PAIR_RECORD=file program
//
// Records what the spaces of any program with ODE report, so that two runs with different spaces
// can be compared. Each dSpaceCollide and dSpaceCollide2 of the program first collects the pairs,
// then calls the program's callback in the order in which the geoms were created. So two runs stay
// the same, bit for bit, as long as their spaces report the same pairs, in whatever order.
//
// PAIR_RECORD_CALLS=n ends the program after n calls, for programs that do not end by themselves.
//
// PAIR_RECORD gets a line a call: its number, the number of pairs owed and their digest. Pairs that
// are not owed (bounds that do not overlap, empty sub-spaces, bits or bodies that rule them out)
// and pairs that are owed but not reported are counted at its end, with the time the spaces took.
//
// It is linked with ODE, so that ODE is in the process wherever the program gets it from.
#include <dlfcn.h>
#include <ode/ode.h>

#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <unordered_map>
#include <vector>

#pragma GCC diagnostic ignored "-Wdeprecated-declarations"  // dCreateGeomTransform

namespace {

using Clock = std::chrono::steady_clock;

struct Pair {
  dGeomID first, second;
};

struct Record {
  std::FILE* file = nullptr;
  std::unordered_map<dGeomID, std::uint32_t> ids;  // by order of creation
  std::uint32_t last_id = 0;
  std::uint64_t calls = 0, owed = 0, unowed = 0, missed = 0, repeated = 0, most_geoms = 0;
  std::uint64_t most_calls = 0;
  double seconds = 0;

  Record() {
    const char* const most = std::getenv("PAIR_RECORD_CALLS");
    if (most) most_calls = std::strtoull(most, nullptr, 10);
    const char* const name = std::getenv("PAIR_RECORD");
    if (name && *name) file = std::fopen(name, "w");
  }
  ~Record() {
    if (!file) return;
    std::fprintf(file,
                 "calls,geoms,owed,unowed,missed,repeated,seconds\n%" PRIu64 ",%" PRIu64 ",%" PRIu64
                 ",%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%.6f\n",
                 calls, most_geoms, owed, unowed, missed, repeated, seconds);
    std::fclose(file);
  }
  std::uint32_t id(dGeomID geom) {
    std::uint32_t& known = ids[geom];
    if (!known) known = ++last_id;
    return known;
  }
};

Record& record() {
  static Record the_record;
  return the_record;
}

template <class Geom>
Geom created(Geom geom) {
  record().ids[reinterpret_cast<dGeomID>(geom)] = ++record().last_id;
  return geom;
}

template <class Function>
Function* next(const char* name) {
  void* const function = dlsym(RTLD_NEXT, name);
  if (function) return reinterpret_cast<Function*>(function);
  std::fprintf(stderr, "pair recorder: no %s\n", name);
  std::abort();
}

bool isEmptySpace(dGeomID geom) {
  if (!dGeomIsSpace(geom)) return false;
  const dSpaceID space = reinterpret_cast<dSpaceID>(geom);
  // ODE's quadtree cannot enumerate its geoms.
  if (dGeomGetClass(geom) == dQuadTreeSpaceClass) return dSpaceGetNumGeoms(space) == 0;
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i)
    if (!isEmptySpace(dSpaceGetGeom(space, i))) return false;
  return true;
}

bool isOwed(dGeomID a, dGeomID b) {
  if (!dGeomIsEnabled(a) || !dGeomIsEnabled(b) || isEmptySpace(a) || isEmptySpace(b)) return false;
  if (dGeomGetBody(a) && dGeomGetBody(a) == dGeomGetBody(b)) return false;
  if (!(dGeomGetCategoryBits(a) & dGeomGetCollideBits(b)) &&
      !(dGeomGetCategoryBits(b) & dGeomGetCollideBits(a)))
    return false;
  dReal box_a[6], box_b[6];
  dGeomGetAABB(a, box_a);
  dGeomGetAABB(b, box_b);
  for (int axis = 0; axis < 6; axis += 2)
    if (box_a[axis] > box_b[axis + 1] || box_b[axis] > box_a[axis + 1]) return false;
  return true;
}

void collect(void* pairs, dGeomID first, dGeomID second) {
  static_cast<std::vector<Pair>*>(pairs)->push_back({first, second});
}

std::uint64_t key(const Pair& pair) {
  return std::uint64_t{record().id(pair.first)} << 32 | record().id(pair.second);
}

// Writes the line, counts, and calls the program back.
void replay(std::vector<Pair>& pairs, void* data, dNearCallback* callback) {
  Record& to = record();
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return key(a) < key(b); });
  std::uint64_t digest = 14695981039346656037u, owed = 0, before = 0;
  for (const Pair& pair : pairs) {
    if (key(pair) == before) ++to.repeated;
    before = key(pair);
    if (!isOwed(pair.first, pair.second)) {
      ++to.unowed;
      continue;
    }
    ++owed;
    for (int byte = 0; byte < 64; byte += 8)
      digest = (digest ^ (before >> byte & 255)) * 1099511628211u;
  }
  to.owed += owed;
  if (to.file)
    std::fprintf(to.file, "%" PRIu64 " %" PRIu64 " %016" PRIx64 "\n", to.calls, owed, digest);
  if (++to.calls == to.most_calls) std::exit(0);
  for (const Pair& pair : pairs) callback(data, pair.first, pair.second);
}

// Tests all pairs of the space, which is slow and sure.
void countMissed(dSpaceID space, const std::vector<Pair>& pairs) {
  std::vector<dGeomID> geoms;
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) geoms.push_back(dSpaceGetGeom(space, i));
  std::uint64_t all_owed = 0, reported = 0;
  for (std::size_t i = 0; i < geoms.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) all_owed += isOwed(geoms[i], geoms[j]);
  for (const Pair& pair : pairs) reported += isOwed(pair.first, pair.second);
  record().missed += all_owed - std::min(all_owed, reported);
  record().most_geoms = std::max<std::uint64_t>(record().most_geoms, geoms.size());
}

}  // namespace

extern "C" {

void dSpaceCollide(dSpaceID space, void* data, dNearCallback* callback) {
  static auto* const real = next<decltype(dSpaceCollide)>("dSpaceCollide");
  std::vector<Pair> pairs;
  const Clock::time_point begin = Clock::now();
  real(space, &pairs, collect);
  record().seconds += std::chrono::duration<double>(Clock::now() - begin).count();
  // QuadTree spaces have no dSpaceGetGeom.
  if (dSpaceGetClass(space) != dQuadTreeSpaceClass) countMissed(space, pairs);
  for (Pair& pair : pairs)
    if (record().id(pair.first) > record().id(pair.second)) std::swap(pair.first, pair.second);
  replay(pairs, data, callback);
}

void dSpaceCollide2(dGeomID a, dGeomID b, void* data, dNearCallback* callback) {
  static auto* const real = next<decltype(dSpaceCollide2)>("dSpaceCollide2");
  std::vector<Pair> pairs;
  const Clock::time_point begin = Clock::now();
  real(a, b, &pairs, collect);
  record().seconds += std::chrono::duration<double>(Clock::now() - begin).count();
  replay(pairs, data, callback);
}

// A step on several threads is not the same twice.
void dWorldSetStepThreadingImplementation(dWorldID, const dThreadingFunctionsInfo*,
                                          dThreadingImplementationID) {}

// The preload library makes a geom and destroys it to see whether it knows its layout: that must
// not shift the numbers of the program's own.
void dGeomDestroy(dGeomID geom) {
  static auto* const real = next<decltype(dGeomDestroy)>("dGeomDestroy");
  if (record().id(geom) == record().last_id) --record().last_id;
  record().ids.erase(geom);
  real(geom);
}

#define CREATES(type, name, parameters, arguments)         \
  type name parameters {                                   \
    static auto* const real = next<decltype(name)>(#name); \
    return created(real arguments);                        \
  }

CREATES(dGeomID, dCreateSphere, (dSpaceID s, dReal r), (s, r))
CREATES(dGeomID, dCreateBox, (dSpaceID s, dReal x, dReal y, dReal z), (s, x, y, z))
CREATES(dGeomID, dCreatePlane, (dSpaceID s, dReal a, dReal b, dReal c, dReal d), (s, a, b, c, d))
CREATES(dGeomID, dCreateCapsule, (dSpaceID s, dReal r, dReal l), (s, r, l))
CREATES(dGeomID, dCreateCylinder, (dSpaceID s, dReal r, dReal l), (s, r, l))
CREATES(dGeomID, dCreateRay, (dSpaceID s, dReal l), (s, l))
CREATES(dGeomID, dCreateGeomTransform, (dSpaceID s), (s))
CREATES(dGeomID, dCreateGeom, (int c), (c))
CREATES(dGeomID, dCreateHeightfield, (dSpaceID s, dHeightfieldDataID d, int p), (s, d, p))
CREATES(dGeomID, dCreateConvex,
        (dSpaceID s, const dReal* planes, unsigned n, const dReal* points, unsigned m,
         const unsigned* polygons),
        (s, planes, n, points, m, polygons))
CREATES(dGeomID, dCreateTriMesh,
        (dSpaceID s, dTriMeshDataID d, dTriCallback* c, dTriArrayCallback* a, dTriRayCallback* r),
        (s, d, c, a, r))
CREATES(dSpaceID, dSimpleSpaceCreate, (dSpaceID s), (s))
CREATES(dSpaceID, dHashSpaceCreate, (dSpaceID s), (s))
CREATES(dSpaceID, dSweepAndPruneSpaceCreate, (dSpaceID s, int order), (s, order))
CREATES(dSpaceID, dQuadTreeSpaceCreate,
        (dSpaceID s, const dVector3 center, const dVector3 extents, int depth),
        (s, center, extents, depth))
}
