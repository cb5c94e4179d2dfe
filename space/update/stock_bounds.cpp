#include "space/update/stock_bounds.h"

#include "space/data/floating_point.h"

namespace ode_parallel_sap {

namespace {

// Any generator will do (splitmix64).
class Bits {
 public:
  explicit Bits(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t bits = state_ += 0x9e3779b97f4a7c15;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111eb;
    return bits ^ (bits >> 31);
  }
  // From -most to most.
  dReal within(dReal most) {
    const double part = static_cast<double>(next() >> 11) / 9007199254740992.0;
    return static_cast<dReal>((2 * part - 1) * static_cast<double>(most));
  }
  dReal any() {
    const std::uint64_t bits = next();
    dReal value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

 private:
  std::uint64_t state_;
};

// The numbers of a geom's size, whose class is one of StockBounds.
int sizesOf(dxGeom* geom, dReal* sizes[3]) {
  switch (geom->type) {
    case dSphereClass:
      sizes[0] = &static_cast<dxSphere*>(geom)->radius;
      return 1;
    case dBoxClass:
      for (int axis = 0; axis < 3; ++axis) sizes[axis] = &static_cast<dxBox*>(geom)->side[axis];
      return 3;
    case dCapsuleClass:
      sizes[0] = &static_cast<dxCapsule*>(geom)->radius;
      sizes[1] = &static_cast<dxCapsule*>(geom)->lz;
      return 2;
    default:
      sizes[0] = &static_cast<dxCylinder*>(geom)->radius;
      sizes[1] = &static_cast<dxCylinder*>(geom)->lz;
      return 2;
  }
}

// Every fourth time numbers of any bits: infinite, NaN, denormal, far too large. Rotations need not
// be any for bounds to be computed.
void pose(dxGeom* geom, bool usual, Bits& bits) {
  constexpr dReal reach = 1000, length = 10;  // fixed: any that programs have
  dxPosR& at = *geom->final_posr;
  dReal* sizes[3];
  const int count = sizesOf(geom, sizes);
  for (int axis = 0; axis < 3; ++axis) at.pos[axis] = usual ? bits.within(reach) : bits.any();
  for (int i = 0; i < 12; ++i) at.R[i] = usual ? bits.within(1) : bits.any();
  for (int i = 0; i < count; ++i) *sizes[i] = usual ? std::fabs(bits.within(length)) : bits.any();
}

bool sameBounds(const dReal* a, const dReal* b) {
  for (int i = 0; i < 6; ++i)
    if (std::memcmp(a + i, b + i, sizeof *a) != 0 && !(a[i] != a[i] && b[i] != b[i])) return false;
  return true;
}

}  // namespace

bool StockBounds::agree(dxGeom* geom, std::size_t poses, std::uint64_t seed) {
  const ScopedMode exact(exactMode());
  Bits bits(seed);
  for (std::size_t i = 0; i < poses; ++i) {
    pose(geom, i % 4 != 3, bits);
    geom->computeAABB();
    dReal expected[6];
    std::memcpy(expected, geom->aabb, sizeof expected);
    compute(geom);
    if (!sameBounds(geom->aabb, expected)) return false;
  }
  return true;
}

void StockBounds::learn(dxGeom* geom, std::size_t poses) {
  if (!agree(geom, poses, 1)) return;
  tables_[geom->type] = tableOf(geom);
}

StockBounds StockBounds::compareAll() {
  // fixed: a last bit that is another in one pose of ten is found but for one time in 10^11
  constexpr std::size_t poses = 320;
  // Not by ODE's functions: whoever watches these need not see geoms that no program made.
  dxSphere sphere(nullptr, 1);
  dxBox box(nullptr, 1, 1, 1);
  dxCapsule capsule(nullptr, 1, 1);
  dxCylinder cylinder(nullptr, 1, 1);
  StockBounds bounds;
  for (dxGeom* const geom : {static_cast<dxGeom*>(&sphere), static_cast<dxGeom*>(&box),
                             static_cast<dxGeom*>(&capsule), static_cast<dxGeom*>(&cylinder)})
    bounds.learn(geom, poses);
  return bounds;
}

}  // namespace ode_parallel_sap
