#include "space/update/stock_bounds.h"

#include <type_traits>

#include "space/data/floating_point.h"
#include "space/data/round_outward.h"

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

bool StockBounds::packsAlike(dxGeom* geom, PackShapes packShapes, std::size_t poses,
                             std::uint64_t seed, std::size_t* fine) {
  const ScopedMode exact(exactMode());
  const ShapeLayout layout = layoutOf(geom);
  void* const shape = geom;
  const std::uint32_t slot = 0;
  Bits bits(seed);
  for (std::size_t i = 0; i < poses; ++i) {
    pose(geom, i % 4 != 3, bits);
    Box box, expected_box;
    const PackedShapes packed = packShapes(shapeOf(geom), {&shape, &slot, 1}, layout, &box);
    dReal bounds[6];
    std::memcpy(bounds, geom->aabb, sizeof bounds);
    geom->computeAABB();
    const BoundsFacts facts = roundOutward(geom->aabb, expected_box);
    if (!packed.fine && !packed.coarse) continue;
    if (fine && packed.fine) ++*fine;
    if (facts.nan || facts.unbounded || facts.coarse != (packed.coarse != 0) ||
        facts.exact != packed.exact || packed.fine + packed.coarse != 1 ||
        !sameBounds(bounds, geom->aabb) || std::memcmp(&box, &expected_box, sizeof box) != 0)
      return false;
  }
  return true;
}

ShapeLayout StockBounds::layoutOf(const dxGeom* geom) {
  const auto bytesTo = [geom](const void* member) {
    return static_cast<std::size_t>(static_cast<const char*>(member) -
                                    reinterpret_cast<const char*>(geom));
  };
  const auto layoutWith = [&](const dReal* size) -> ShapeLayout {
    return {bytesTo(&geom->final_posr), bytesTo(size), bytesTo(geom->aabb)};
  };
  switch (shapeOf(geom)) {
    case ShapeKind::sphere:
      return layoutWith(&static_cast<const dxSphere*>(geom)->radius);
    case ShapeKind::box:
      return layoutWith(static_cast<const dxBox*>(geom)->side);
    default:
      return layoutWith(&static_cast<const dxCapsule*>(geom)->radius);
  }
}

void StockBounds::learn(dxGeom* geom, std::size_t poses) {
  if (!agree(geom, poses, 1)) return;
  tables_[geom->type] = tableOf(geom);
  const PackShapes packShapes = kernelSet().packShapes;
  if (std::is_same<dReal, double>::value && geom->type < shapes && packShapes &&
      packsAlike(geom, packShapes, poses, 1))
    shape_tables_[geom->type] = tableOf(geom);
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
