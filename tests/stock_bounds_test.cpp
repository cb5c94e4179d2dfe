// AABBs that are computed without ODE's virtual calls are those that ODE computes. Sees ODE's
// private headers.
#include "space/update/stock_bounds.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include "space/data/round_outward.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"

using namespace sap_test;
using ode_parallel_sap::Box;
using ode_parallel_sap::PackShapes;
using ode_parallel_sap::ShapeKind;
using ode_parallel_sap::ShapeLayout;
using ode_parallel_sap::StockBounds;

namespace {

struct StockClass {
  const char* name;
  dGeomID (*create)(dSpaceID space, dReal a, dReal b, dReal c);
};
constexpr StockClass stock_classes[] = {
    {"sphere", [](dSpaceID space, dReal a, dReal, dReal) { return dCreateSphere(space, a); }},
    {"box", [](dSpaceID space, dReal a, dReal b, dReal c) { return dCreateBox(space, a, b, c); }},
    {"capsule",
     [](dSpaceID space, dReal a, dReal b, dReal) { return dCreateCapsule(space, a, b); }},
    {"cylinder",
     [](dSpaceID space, dReal a, dReal b, dReal) { return dCreateCylinder(space, a, b); }},
};

// As another compiler might have made it: now and then a last bit is another.
struct OtherSphere : dxSphere {
  OtherSphere() : dxSphere(nullptr, 1) {}
  void computeAABB() override {
    dxSphere::computeAABB();
    unsigned char low;
    std::memcpy(&low, &aabb[1], 1);
    if (low % 8 == 0) aabb[1] = std::nextafter(aabb[1], dInfinity);
  }
};

// A program's own class, by the number of a stock class.
struct OwnSphere : dxSphere {
  explicit OwnSphere(dSpaceID space) : dxSphere(space, 1) {}
  void computeAABB() override {
    ++calls;
    for (int i = 0; i < 6; ++i) aabb[i] = static_cast<dReal>(i % 2 ? 7 : -7);
  }
  int calls = 0;
};

void turn(Random& random, dMatrix3 rotation) {
  const auto part = [&] { return static_cast<dReal>(random.between(-1, 1)); };
  dRFromAxisAndAngle(rotation, part(), part(), part() + 2, 3 * part());
}

// A geom in a space and one in none, which ODE keeps up to date itself.
struct Twins {
  dGeomID in_space, alone;

  void move(Random& random, double reach) {
    dMatrix3 rotation;
    turn(random, rotation);
    dReal at[3];
    for (dReal& x : at) x = static_cast<dReal>(random.between(-reach, reach));
    for (const dGeomID geom : {in_space, alone}) {
      dGeomSetPosition(geom, at[0], at[1], at[2]);
      dGeomSetRotation(geom, rotation);
    }
  }
  bool same() const {
    dReal a[6], b[6];
    dGeomGetAABB(in_space, a);
    dGeomGetAABB(alone, b);
    return std::memcmp(a, b, sizeof a) == 0;
  }
};

Twins makeTwins(Random& random, const StockClass& of, dSpaceID space, dWorldID world) {
  dReal size[3];
  for (dReal& length : size) length = static_cast<dReal>(random.between(0.1, 3));
  const Twins twins = {of.create(space, size[0], size[1], size[2]),
                       of.create(nullptr, size[0], size[1], size[2])};
  const std::size_t kind = random.below(3);  // alone, on a body, away from its body's place
  if (kind == 0) return twins;
  dMatrix3 rotation;
  turn(random, rotation);
  for (const dGeomID geom : {twins.in_space, twins.alone}) {
    dGeomSetBody(geom, dBodyCreate(world));
    if (kind == 1) continue;
    dGeomSetOffsetPosition(geom, size[0], size[1], size[2]);
    dGeomSetOffsetRotation(geom, rotation);
  }
  return twins;
}

void ignorePair(void*, dGeomID, dGeomID) {}

// A shape of which a kernel is told where its parts lie.
struct PlainShape {
  double pose[16], size[4], bounds[6];
  const double* at = pose;
};
constexpr ShapeLayout plain_layout = {offsetof(PlainShape, at), offsetof(PlainShape, size),
                                      offsetof(PlainShape, bounds)};

// About a power of two, with few bits below the leading one or all of them.
double numberNear(Random& random, int exponent) {
  const double ones[] = {1, 1 + 0x1p-52, 2 - 0x1p-52, 1 + random.unit()};
  return std::ldexp(ones[random.below(4)], exponent + static_cast<int>(random.below(4)) - 2);
}

double reachOf(ShapeKind kind, const double* row, const double* size) {
  if (kind == ShapeKind::sphere) return size[0];
  if (kind == ShapeKind::capsule) return std::fabs(row[2] * size[1]) * 0.5 + size[0];
  return 0.5 *
         (std::fabs(row[0] * size[0]) + std::fabs(row[1] * size[1]) + std::fabs(row[2] * size[2]));
}

// Where a bound is nothing or next to it, or where the steps of floats begin to be coarse.
double placeNear(Random& random, double reach) {
  const double places[] = {reach,
                           std::nextafter(reach, 0),
                           std::nextafter(reach, 2 * reach),
                           std::ldexp(reach, 13 + static_cast<int>(random.below(6))),
                           std::ldexp(reach, 20 + static_cast<int>(random.below(40))),
                           reach * random.unit()};
  return places[random.below(6)] * (random.below(2) ? 1 : -1);
}

void pose(Random& random, ShapeKind kind, int exponent, PlainShape& shape) {
  for (double& length : shape.size) length = numberNear(random, exponent);
  for (double& part : shape.pose) part = random.between(-1, 1);
  for (int axis = 0; axis < 3; ++axis)
    shape.pose[axis] = placeNear(random, reachOf(kind, shape.pose + 4 + 4 * axis, shape.size));
}

// Whether a shape that was packed, as a coarse one or a fine one, has these bounds and this box.
// Clears `exact` if not all bounds are floats.
bool isPackedRight(ShapeKind kind, const PlainShape& shape, const Box& box, bool coarse,
                   bool& exact) {
  double bounds[6];
  for (int axis = 0; axis < 3; ++axis) {
    const double reach = reachOf(kind, shape.pose + 4 + 4 * axis, shape.size);
    bounds[2 * axis] = shape.pose[axis] - reach;
    bounds[2 * axis + 1] = shape.pose[axis] + reach;
  }
  Box expected;
  const auto facts = ode_parallel_sap::roundOutwardOneByOne(bounds, expected);
  exact = exact && facts.exact;
  return !facts.nan && !facts.unbounded && facts.coarse == coarse &&
         std::memcmp(bounds, shape.bounds, sizeof bounds) == 0 &&
         std::memcmp(&box, &expected, sizeof box) == 0;
}

struct Counts {
  int fine = 0, coarse = 0, neither = 0;
};

// Packs a list of shapes of about this size, and counts these; false if one that was packed is not
// as it should be.
bool packsList(Random& random, PackShapes packShapes, ShapeKind kind, int exponent,
               Counts& counts) {
  PlainShape shapes[9];
  void* list[9];
  std::uint32_t slots[9];
  Box boxes[9];
  const std::size_t count = 1 + random.below(random.below(2) ? 9 : 1);
  for (std::size_t i = 0; i < count; ++i) {
    pose(random, kind, exponent, shapes[i]);
    list[i] = shapes + i;
    slots[i] = static_cast<std::uint32_t>(count - 1 - i);
  }
  const ode_parallel_sap::PackedShapes packed =
      packShapes(kind, {list, slots, count}, plain_layout, boxes);
  bool right = (packed.fine & packed.coarse) == 0 && (packed.fine | packed.coarse) >> count == 0;
  bool exact = true;
  int others = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const bool fine = packed.fine >> i & 1, coarse = packed.coarse >> i & 1;
    counts.fine += fine;
    counts.coarse += coarse;
    others += !fine && !coarse;
    if (fine || coarse)
      right = isPackedRight(kind, shapes[i], boxes[slots[i]], coarse, exact) && right;
  }
  counts.neither += others;
  // Of others the bounds are of no use, but they may be rounded ones.
  return right && (exact == packed.exact || (others && exact));
}

}  // namespace

// ODE_PARALLEL_SAP_TEST_SCALE=1000: 100 million poses of each class.
TEST_CASE("AABBs of ODE's simple classes are computed bit for bit as the loaded ODE does") {
  const std::uint64_t seed = seedOr(17);
  for (const StockClass& of : stock_classes) {
    INFO(of.name << ", seed " << seed);
    const dGeomID geom = of.create(nullptr, 1, 1, 1);
    const bool known = StockBounds::ofLoadedOde().knows(geom);
    if (known) CHECK(StockBounds::agree(geom, static_cast<std::size_t>(scaled(100000)), seed));
#if defined(__x86_64__)
    CHECK(known);  // without a contraction there is nothing to differ in
    if (ode_parallel_sap::kernelSet().packShapes && sizeof(dReal) == sizeof(double))
      CHECK(StockBounds::ofLoadedOde().knowsShape(geom) == (&of - stock_classes < 3));
#endif
    dGeomDestroy(geom);
  }
}

// ODE_PARALLEL_SAP_TEST_SCALE=1000: 100 million poses of each class with each instruction set.
TEST_CASE(
    "Every instruction set packs spheres, boxes and capsules bit for bit as one geom at a time") {
  const std::uint64_t seed = seedOr(19);
  for (const ode_parallel_sap::KernelSet* const* set = ode_parallel_sap::allKernelSets(); *set;
       ++set) {
    if (!(*set)->packShapes || sizeof(dReal) != sizeof(double)) continue;
    for (int of = 0; of < 3; ++of) {
      INFO((*set)->name << ", " << stock_classes[of].name << ", seed " << seed);
      const dGeomID geom = stock_classes[of].create(nullptr, 1, 1, 1);
      const std::size_t poses = static_cast<std::size_t>(scaled(100000));
      std::size_t fine = 0;
      CHECK(StockBounds::packsAlike(geom, (*set)->packShapes, poses, seed, &fine));
      CHECK(fine > poses / 2);  // the usual ones, of three in four
      dGeomDestroy(geom);
    }
  }
}

TEST_CASE("Lists of shapes are packed right up to the least and the greatest that is fine") {
  constexpr ShapeKind kinds[] = {ShapeKind::sphere, ShapeKind::box, ShapeKind::capsule};
  const std::uint64_t seed = seedOr(20);
  for (const ode_parallel_sap::KernelSet* const* set = ode_parallel_sap::allKernelSets(); *set;
       ++set) {
    if (!(*set)->packShapes) continue;
    for (const ShapeKind kind : kinds)
      for (const int exponent : {-120, -65, 0, 108}) {
        INFO((*set)->name << ", kind " << static_cast<int>(kind) << ", sizes of 2^" << exponent
                          << ", seed " << seed);
        Random random(seed);
        const int lists = scaled(10000);
        Counts counts;
        int wrong = 0;
        for (int i = 0; i < lists; ++i)
          wrong += !packsList(random, (*set)->packShapes, kind, exponent, counts);
        CHECK(wrong == 0);
        CHECK((counts.fine > lists / 10) == (exponent != -120));
        CHECK((counts.coarse > lists / 10) == (exponent == -65 || exponent == 0));
        CHECK((counts.neither > lists / 100) == (exponent != 0));
      }
  }
}

TEST_CASE("A class of which now and then a last bit is another is left to ODE") {
  OtherSphere other;
  StockBounds bounds;
  bounds.learn(&other, 320);
  CHECK_FALSE(bounds.knows(&other));
  const dGeomID sphere = dCreateSphere(nullptr, 1);
  bounds.learn(sphere, 320);
  CHECK(bounds.knows(sphere));
  CHECK_FALSE(bounds.knows(&other));
  dGeomDestroy(sphere);
}

TEST_CASE("A geom that calls itself one of ODE's and is not computes its own AABB") {
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  for (int i = 0; i < 300; ++i) dGeomSetPosition(dCreateSphere(space, 1), 100, 100, dReal(3 * i));
  OwnSphere own(space);
  dSpaceCollide(space, nullptr, ignorePair);
  CHECK(own.calls == 1);
  CHECK(own.aabb[3] == 7);
  dGeomSetPosition(&own, 1, 2, 3);
  dSpaceCollide(space, nullptr, ignorePair);
  CHECK(own.calls == 2);
  dSpaceRemove(space, &own);
  dSpaceDestroy(space);
}

TEST_CASE("AABBs of geoms in the space are those of the same geoms in none") {
  const std::uint64_t seed = seedOr(18);
  INFO("seed " << seed);
  Random random(seed);
  const dWorldID world = dWorldCreate();
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  std::vector<Twins> twins;
  for (int i = 0; i < 400; ++i)
    twins.push_back(makeTwins(random, stock_classes[random.below(4)], space, world));
  for (int frame = 0; frame < scaled(40); ++frame) {
    const double reach = std::pow(10, random.between(-3, 6));
    for (Twins& pair : twins)
      if (frame % 3 == 0 || random.below(4) == 0) pair.move(random, reach);
    dParallelSAPSpaceSetNumThreads(space, 1 + frame % 3);
    dSpaceCollide(space, nullptr, ignorePair);
    std::size_t same = 0;
    for (const Twins& pair : twins) same += pair.same();
    REQUIRE(same == twins.size());
  }
  for (const Twins& pair : twins) dGeomDestroy(pair.alone);
  dSpaceDestroy(space);
  dWorldDestroy(world);
}
