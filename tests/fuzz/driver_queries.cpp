// Rays and probes in batches, held against loops over dCollide.
#include <atomic>
#include <new>
#include <type_traits>

#include "driver.h"

namespace sap_test {
namespace {

// A query filter that lets pass what ODE cannot collide, and something else for each query, and may
// throw in some of its calls. It notes whether it is asked about a space, or a geom beside the
// query, or in another floating-point mode than the program's.
template <class Batch>
struct QueryFilter {
  const Batch& batch;
  std::size_t salt;
  std::atomic<bool> is_needless{false}, is_other_mode{false};
  unsigned mode = 0;
  std::atomic<int> calls{0};
  int first = 0, last = 0;  // of the calls that throw
  bool lacks_memory = false;

  bool meets(std::size_t query, dGeomID geom) const {
    return isTame(geom, std::is_same_v<Batch, RayBatch>) &&
           (7 * query + 11 * number(geom) + salt) % 5 != 0;
  }
  static int ask(void* data, std::size_t query, dGeomID geom) {
    QueryFilter& self = *static_cast<QueryFilter*>(data);
    if (dGeomIsSpace(geom) || !overlap(boundsOf(geom), self.batch.bounds(query)))
      self.is_needless = true;
    if (FloatingPointMode::current() != self.mode) self.is_other_mode = true;
    if (const int call = self.calls++; call >= self.first && call < self.last) {
      if (self.lacks_memory) throw std::bad_alloc();
      throw call;
    }
    return self.meets(query, geom);
  }

  void throwFromSomeCallOn(bool of_memory, bool for_good, Random& random) {
    first = static_cast<int>(random.below(60));
    last = for_good ? std::numeric_limits<int>::max() : first + 1;
    lacks_memory = of_memory;
    calls = 0;
  }
  // One exception leaves the call, and nothing is reported.
  std::string problemOfThrowing(dSpaceID space, int flags, Random& random) {
    const bool of_memory = random.chance(0.3);
    throwFromSomeCallOn(of_memory, of_memory || random.chance(0.5), random);
    bool has_left = false;
    std::size_t reports = 0;
    try {
      batch.report(space, flags, [&](dGeomID) { ++reports; });
    } catch (int) {
      has_left = !of_memory;
    } catch (const std::bad_alloc&) {
      has_left = of_memory;
    }
    return has_left == (calls > first) && !(has_left && reports) ? "" : "a call whose filter threw";
  }
};

// A few rays are none, or have bits of one side only.
void spoil(Rays& rays, Random& random) {
  constexpr dReal infinity = std::numeric_limits<dReal>::infinity();
  for (dParallelSAPRay& ray : rays) {
    const dReal values[] = {infinity, -infinity, std::numeric_limits<dReal>::quiet_NaN(), -1};
    const dReal value = values[random.below(3)];
    const std::size_t what = random.below(60), axis = random.below(3);
    if (what == 0) ray.origin[axis] = value;
    if (what == 1) ray.direction[axis] = value;
    if (what == 2) std::fill(ray.direction, ray.direction + 3, dReal(0));
    if (what == 3) ray.length = values[1 + random.below(3)];
    if (what == 4) ray.length = 0;
    if (what == 8) ray.direction[axis] = real(1e300);
    if (what == 5 || what == 6) ray.category_bits = 0;
    if (what == 6 || what == 7) ray.collide_bits = 0;
  }
}

}  // namespace

void Driver::askBatches() {
  decisions_.chance(128) ? askBatch<RayBatch>() : askBatch<ProbeBatch>();
}

// Some geoms change between placing the batch, for which their bounds are asked, and asking it.
template <class Batch>
void Driver::askBatch() {
  const int space = pickOurSpace();
  const dSpaceID id = spaceOf(space);
  const std::size_t queries = 1 + decisions_.below(alive_.size() > 500 ? 20 : 80);
  const double parts[] = {0, 0.01, 0.1, 1}, changing = parts[decisions_.below(std::size(parts))];
  const std::size_t salt = decisions_.below(256);
  constexpr bool are_rays = std::is_same_v<Batch, RayBatch>;
  Random random = decisions_.random();
  log(std::to_string(queries) + (are_rays ? " rays" : " probes") + " at " + std::to_string(space) +
      ", changing " + std::to_string(changing));
  Batch batch(queries, random);
  QueryFilter<Batch> filter = {batch, salt};
  for (std::size_t round = random.below(4); round > 0 && problem_.empty(); --round) {
    std::vector<dGeomID> geoms;
    for (const int object : within(space))
      if (const Object& o = objects_[object];
          (o.kind < kUser || o.kind == kMesh) && isTame(o.geom, are_rays))
        geoms.push_back(o.geom);
    if (geoms.empty()) return;
    batch.moveTo(geoms);
    if constexpr (are_rays) spoil(batch.rays, random);
    for (const int object : within(space))
      if (random.chance(changing)) changeAnyhow(object, random);
    const int flags = batch.someFlags();
    const FloatingPointMode scoped(mode());
    filter.mode = FloatingPointMode::current();
    const int threads = dParallelSAPSpaceGetNumThreads(id);
    dParallelSAPSpaceSetNumThreads(id, 1 + static_cast<int>(random.below(7)));
    dParallelSAPSpaceSetQueryFilter(id, filter.ask, &filter);
    // Where memory ends once, queries are answered one by one.
    Random throwing(256 * round + salt);
    if (throwing.chance(0.3)) filter.throwFromSomeCallOn(true, false, throwing);
    const auto got = batch.ask(id, flags);
    std::string problem;
    if (throwing.chance(0.3)) problem = filter.problemOfThrowing(id, flags, throwing);
    filter.last = 0;
    dParallelSAPSpaceSetQueryFilter(id, nullptr, nullptr);
    dParallelSAPSpaceSetNumThreads(id, threads);
    if (problem.empty())
      problem = difference(
          got, batch.owed(id, membersOf(space), flags,
                          [&](std::size_t i, dGeomID geom) { return filter.meets(i, geom); }));
    if (filter.is_needless) fail("a filter was asked about a space, or a geom beside the query");
    if (filter.is_other_mode) fail("a filter was asked in another floating-point mode");
    if (!problem.empty()) fail("queries of space " + std::to_string(space) + ": " + problem);
    ++collides_;
  }
}

}  // namespace sap_test
