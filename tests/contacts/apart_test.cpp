// Of pairs that are left out as certainly apart dCollide finds no contact. Reaches behind the
// interface, for millions of pairs.
#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "space/contacts/narrow_phase.h"
#include "space/simd/kernels.h"
#include "support/catch.hpp"
#include "support/floating_point.h"
#include "support/knobs.h"
#include "support/ode_errors.h"
#include "support/random.h"

using namespace ode_parallel_sap;
using namespace sap_test;

namespace {

constexpr double kEpsilon = static_cast<double>(std::numeric_limits<dReal>::epsilon());
constexpr bool kSingle = sizeof(dReal) == sizeof(float);

struct DestroyGeom {
  void operator()(dGeomID geom) const { dGeomDestroy(geom); }
};
using Geom = std::unique_ptr<dxGeom, DestroyGeom>;

// How far out of the ordinary the numbers of a pair are.
enum class Numbers { ordinary, degenerate, any };

dReal someSize(Random& random, double scale, Numbers numbers) {
  if (numbers != Numbers::ordinary && random.chance(0.3)) {
    const double odd[] = {0, 1e-6, 1e-12, 1e6};
    return static_cast<dReal>(odd[random.below(4)] * scale);
  }
  return static_cast<dReal>(scale * random.between(0.2, 2));
}

dReal someNumber(Random& random) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double odd[] = {0,     -0.0, 1e-320, 1e-40, 1e-30, 1e-20,    1e-8,      1,
                        3,     1e10, 1e12,   1e19,  1e30,  1e38,     1e150,     1e200,
                        1e308, -1,   -1e20,  -1e99, 1e-99, infinity, -infinity, std::nan("")};
  return static_cast<dReal>(odd[random.below(std::size(odd))] * random.between(0.5, 1.5));
}

dReal randomEntry(Random& random) {
  return static_cast<dReal>(random.between(-1, 1));
}

// Random or along the axes, nearly so, drifted, or none at all.
void turn(dGeomID geom, Random& random, Numbers numbers) {
  dMatrix3 matrix;
  dQuaternion q = {randomEntry(random), randomEntry(random), randomEntry(random),
                   randomEntry(random)};
  const std::size_t way = random.below(numbers == Numbers::ordinary ? 4 : 8);
  if (way == 0) return;
  if (way <= 2) {  // by 0 to 3 quarters about an axis, and a little further
    dRFromAxisAndAngle(matrix, way == 1, way == 2, 1,
                       static_cast<dReal>(random.below(4) * M_PI / 2));
    const double off = random.chance(0.5) ? 0 : std::pow(10, random.between(-17, -1));
    const dQuaternion little = {1, static_cast<dReal>(off), static_cast<dReal>(off / 3), 0};
    dMatrix3 by, both;
    dQtoR(little, by);
    dMultiply0_333(both, matrix, by);
    std::copy(both, both + 12, matrix);
  } else {
    dNormalize4(q);
    dQtoR(q, matrix);
  }
  if (way >= 4) {
    const double off = std::pow(10, random.between(-16, way == 7 ? 1 : -3));
    for (dReal& entry : matrix)
      entry = static_cast<dReal>(entry * (way == 4 ? 1 + off : 1 + off * random.between(-1, 1)));
  }
  if (way == 6 && numbers == Numbers::any) matrix[random.below(12)] = someNumber(random);
  dGeomSetRotation(geom, matrix);
}

Geom makeBox(Random& random, double scale, Numbers numbers) {
  const auto size = [&] { return someSize(random, scale, numbers); };
  return Geom(dCreateBox(nullptr, size(), size(), size()));
}

// Sizes that ODE's assertions let through.
void makeOdd(dGeomID geom, Random& random) try {
  dGeomBoxSetLengths(geom, someNumber(random), someNumber(random), someNumber(random));
} catch (const OdeAssertion&) {
}

// Two boxes and how far the second is moved along a line.
class Pair {
 public:
  Pair(Random& random, Numbers numbers) {
    const double scales[] = {1, 1, 1e-4, 1e3, 1e-2, 1e6};
    const double places[] = {0, 1, 100, 1e4, 1e7, 1e12};
    const double scale = scales[random.below(std::size(scales))];
    const double place =
        scale * places[random.below(numbers == Numbers::ordinary ? 3 : std::size(places))];
    for (Geom* const geom : {&a, &b}) {
      *geom = makeBox(random, scale, numbers);
      turn(geom->get(), random, numbers);
    }
    double length = 0;
    for (int i = 0; i < 3; ++i) {
      origin_[i] = place * random.between(-1, 1);
      if (!random.chance(0.3)) direction_[i] = random.between(-1, 1);
      length += direction_[i] * direction_[i];
    }
    if (length == 0) direction_[2] = 1;
    dGeomSetPosition(a.get(), at(0, 0), at(1, 0), at(2, 0));
    unit_ = 8 * scale + std::fabs(place);
    move(0);
  }

  void move(double far) { dGeomSetPosition(b.get(), at(0, far), at(1, far), at(2, far)); }
  // Between a place where they touch, if they do anywhere, and one where they do not.
  double edge() {
    double touching = -unit_, apart = 4 * unit_;
    for (const double start : {0.0, 0.1, 0.3, 0.6}) {
      move(start * unit_);
      if (contacts(1) == 0) continue;
      touching = start * unit_;
      break;
    }
    for (int step = 0; step < 60; ++step) {
      const double middle = touching + (apart - touching) / 2;
      move(middle);
      (contacts(1) ? touching : apart) = middle;
    }
    return apart;
  }
  double unit() const { return unit_; }

  int contacts(int flags) const {
    dContactGeom found[16];
    return dCollide(a.get(), b.get(), flags, found, sizeof *found);
  }
  bool isLeftOut(bool& tested) const {
    const dParallelSAPPair pair = {a.get(), b.get()};
    const ApartBoxes found = certainlyApart(&pair, 1, 1);
    tested = found.tested;
    return found.apart;
  }

  Geom a, b;

 private:
  dReal at(int axis, double far) const {
    return static_cast<dReal>(origin_[axis] + far * direction_[axis]);
  }

  double origin_[3], direction_[3] = {}, unit_;
};

struct Count {
  std::size_t apart = 0, tested = 0, checked = 0;
};

// Whether a pair that is left out has no contact, whatever dCollide is asked for.
void check(const Pair& pair, Count& count) {
  bool tested;
  ++count.checked;
  const bool apart = pair.isLeftOut(tested);
  count.tested += tested;
  if (!apart) return;
  ++count.apart;
  for (const int flags : {1, 2, 8}) {
    CAPTURE(count.checked, flags);
    REQUIRE(pair.contacts(flags) == 0);
  }
}

const unsigned kModes[] = {FloatingPointMode::kDefault, FloatingPointMode::kFlushing,
                           FloatingPointMode::kDownward, FloatingPointMode::kUpward,
                           FloatingPointMode::kTowardZero};

// Steps of single bits and of any size on both sides of where two geoms begin to touch.
void checkAround(Pair& pair, Random& random, Count& count) {
  const double edge = pair.edge();
  const FloatingPointMode scoped(kModes[random.chance(0.5) ? 0 : random.below(std::size(kModes))]);
  for (int step = -2; step <= 4; ++step) {
    pair.move(edge + step * kEpsilon * pair.unit());
    check(pair, count);
  }
  for (int step = 0; step < 16; ++step) {
    pair.move(edge + pair.unit() * std::pow(10, random.between(kSingle ? -7 : -16, 0)));
    check(pair, count);
  }
}

void checkTouching(Numbers numbers) {
  const std::uint64_t seed = seedOr(3101);
  INFO(kernelSet().name << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  Random random(seed);
  Count count;
  for (int i = 0; i < scaled(6000); ++i) {
    Pair pair(random, numbers);
    try {
      checkAround(pair, random, count);
    } catch (const OdeAssertion&) {
      REQUIRE(numbers != Numbers::ordinary);  // ODE's own, of what it cannot collide
    }
  }
  CHECK(count.tested == count.checked);
  // A gap of a thousandth is wide enough; floats decide less.
  CHECK(count.apart > count.checked / (kSingle ? 50 : 6));
}

}  // namespace

TEST_CASE("No pair with a contact is left out, however close to touching", "[apart]") {
  const KernelSet& usual = kernelSet();
  for (const Numbers numbers : {Numbers::ordinary, Numbers::degenerate})
    for (const KernelSet* const* set = allKernelSets(); *set; ++set) {
      chooseKernelSet(**set);
      checkTouching(numbers);
    }
  chooseKernelSet(usual);
}

TEST_CASE("No pair with a contact is left out, whatever its numbers", "[apart]") {
  const std::uint64_t seed = seedOr(3102);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  Random random(seed);
  Count count;
  for (int i = 0; i < scaled(300000); ++i) {
    const Pair pair(random, Numbers::any);
    for (const Geom* geom : {&pair.a, &pair.b}) {
      if (random.chance(0.6)) makeOdd(geom->get(), random);
      if (random.chance(0.6))
        dGeomSetPosition(geom->get(), someNumber(random), someNumber(random), someNumber(random));
    }
    const FloatingPointMode scoped(
        kModes[random.chance(0.5) ? 0 : random.below(std::size(kModes))]);
    check(pair, count);
  }
  CHECK(count.tested == count.checked);
  CHECK(count.apart > count.checked / 100);
}

TEST_CASE("Every instruction set leaves out the same pairs of boxes", "[apart]") {
  const std::uint64_t seed = seedOr(3104);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  Random random(seed);
  std::vector<Pair> geoms;
  std::vector<dParallelSAPPair> pairs;
  for (int i = 0; i < 32; ++i) {
    geoms.emplace_back(random, Numbers::degenerate);
    geoms.back().move(geoms.back().unit() * random.between(0, 0.4));
    pairs.push_back({geoms.back().a.get(), geoms.back().b.get()});
  }
  const KernelSet& usual = kernelSet();
  const std::uint32_t expected = certainlyApart(pairs.data(), 32, ~0u).apart;
  CHECK(expected != 0);
  CHECK(expected != ~0u);
  for (const KernelSet* const* set = allKernelSets(); *set; ++set) {
    chooseKernelSet(**set);
    CAPTURE((*set)->name);
    for (std::size_t count = 0; count <= 32; ++count) {
      const std::uint32_t first = count == 32 ? ~0u : (1u << count) - 1;
      CHECK(certainlyApart(pairs.data(), count, ~0u).apart == (expected & first));
      CHECK(certainlyApart(pairs.data(), 32, first).apart == (expected & first));
    }
  }
  chooseKernelSet(usual);
}

TEST_CASE("Nothing traps that would not trap in ODE", "[apart]") {
  const Geom a(dCreateBox(nullptr, 1, 1, 1)), b(dCreateBox(nullptr, 1, 1, 1));
  dGeomSetPosition(b.get(), kSingle ? dReal(1e19) : dReal(1e99), 0, 0);
  const dParallelSAPPair pair = {a.get(), b.get()};
  const FloatingPointMode scoped(FloatingPointMode::kTrapping);
  CHECK(certainlyApart(&pair, 1, 1).tested == 1);
}

TEST_CASE("An offset geom that has not followed its body is not tested", "[apart]") {
  const dWorldID world = dWorldCreate();
  const dBodyID body = dBodyCreate(world);
  const Geom a(dCreateBox(nullptr, 1, 1, 1)), b(dCreateBox(nullptr, 1, 1, 1));
  dGeomSetBody(a.get(), body);
  dGeomSetOffsetPosition(a.get(), 0, 0, 1);
  dGeomSetPosition(b.get(), 0, 0, 9);
  const dParallelSAPPair pair = {a.get(), b.get()};
  dGeomGetPosition(a.get());
  CHECK(certainlyApart(&pair, 1, 1).apart == 1);
  dBodySetPosition(body, 0, 0, 9);
  CHECK(certainlyApart(&pair, 1, 1).tested == 0);
  dGeomGetPosition(a.get());
  CHECK(certainlyApart(&pair, 1, 1).tested == 1);
  CHECK(certainlyApart(&pair, 1, 1).apart == 0);
  dWorldDestroy(world);
}
