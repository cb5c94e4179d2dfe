#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "../support/not_finite.h"
#include "../support/recorder.h"
#include "../support/user_box.h"
#include "extreme.h"

namespace sap_test {

Scene::Scene(const Configuration& configuration, int threads, std::size_t its_size,
             std::uint64_t seed)
    : Space(configuration),
      World(dSpaceID(*this)),
      size(its_size),
      side(0.95 * std::cbrt(static_cast<double>(size))),
      random(seed) {
  if (threads > 0) dParallelSAPSpaceSetNumThreads(space(), threads);
}

namespace {

using Play = decltype(Extreme::play);

constexpr dReal kLargest = std::numeric_limits<dReal>::max();
constexpr dReal kDenormal = std::numeric_limits<dReal>::denorm_min();

std::string text(double value) {
  std::ostringstream stream;
  stream << value;
  return stream.str();
}

dReal between(Scene& scene, double low, double high) {
  return real(scene.random.between(low, high));
}

std::array<dReal, 3> anywhere(Scene& scene) {
  const dReal x = between(scene, 0, scene.side), y = between(scene, 0, scene.side);
  return {x, y, between(scene, 0, scene.side)};
}

void placeAnywhere(Scene& scene, dGeomID geom) {
  const auto [x, y, z] = anywhere(scene);
  dGeomSetPosition(geom, x, y, z);
}

// Unit boxes of ODE's.
void addUnitBoxes(Scene& scene, std::size_t n) {
  while (n-- > 0) placeAnywhere(scene, scene.take(dCreateBox(scene.space(), 1, 1, 1)));
}

// That are changed in every frame, together or each.
Play onUnitBoxes(Play change) {
  return [change](Scene& scene, int frame) {
    if (frame == 0) addUnitBoxes(scene, scene.size);
    change(scene, frame);
  };
}

Play eachUnitBox(std::function<void(Scene& scene, dGeomID geom, int frame)> change) {
  return onUnitBoxes([change](Scene& scene, int frame) {
    for (const dGeomID geom : scene.geoms()) change(scene, geom, frame);
  });
}

// User boxes, so that no ODE class rounds their extents. Each frame changes this part of them.
Play userBoxes(std::function<Bounds(Scene& scene, int frame)> bounds_of, double part = 1) {
  return [=](Scene& scene, int frame) {
    for (std::size_t i = 0; i < scene.size; ++i) {
      const Bounds bounds = bounds_of(scene, frame);
      if (frame == 0)
        scene.take(createUserBox(scene.space(), bounds));
      else if (scene.random.chance(part))
        setUserBounds(scene.geoms()[i], bounds);
    }
  };
}

Bounds unitBounds(Scene& scene) {
  const auto [x, y, z] = anywhere(scene);
  return {x, x + 1, y, y + 1, z, z + 1};
}

// Unit boxes, and a few user boxes: in each frame another one is made of a unit box.
Play fewAmongUnitBoxes(int few, std::function<void(Scene&, int i, int frame, Bounds&)> change) {
  return onUnitBoxes([=](Scene& scene, int frame) {
    for (int i = 0; i < few; ++i) {
      Bounds bounds = unitBounds(scene);
      if (frame == 0) scene.marked.push_back(scene.take(createUserBox(scene.space(), bounds)));
      change(scene, i, frame, bounds);
      setUserBounds(scene.marked[std::size_t(i)], bounds);
    }
    placeAnywhere(scene, scene.geoms()[scene.random.below(scene.geoms().size())]);
  });
}

// Far away, far apart, all in one place, just touching; minute, huge, long and thin.

Extreme unitBoxesAt(double distance) {
  const Play play = eachUnitBox([far = real(distance)](Scene& scene, dGeomID geom, int) {
    const auto [x, y, z] = anywhere(scene);
    dGeomSetPosition(geom, far + x, -far + y, far + z);
  });
  // Where neighbouring numbers are further apart than the boxes, all are in a few places.
  return {"unit boxes " + text(distance) + " from the origin", play, 1500, 2};
}

// Boxes whose coordinates become others.
Play boxes(Boxes (*make)(std::size_t n, std::uint64_t seed), double factor, double offset,
           bool centred = false) {
  return [=](Scene& scene, int frame) {
    std::size_t at = 0;
    for (const Box& box : make(scene.size, scene.random.bits())) {
      Bounds bounds;
      for (std::size_t i = 0; i < 6; ++i) {
        const double bound = (i % 2 ? box.high : box.low)[i / 2];
        // The largest leave a little room for sums.
        bounds[i] = real(centred ? (bound - scene.side / 2) / (scene.side + 2) * factor
                                 : bound * factor + offset);
      }
      if (frame == 0)
        scene.take(createUserBox(scene.space(), bounds));
      else if (!centred || scene.random.chance(0.6))
        setUserBounds(scene.geoms()[at], bounds);
      ++at;
    }
  };
}

Extreme clustersApart(double distance) {
  const Play play = eachUnitBox([distance](Scene& scene, dGeomID geom, int) {
    const dReal shift = number(geom) % 2 ? real(distance) : 0;
    const auto [x, y, z] = anywhere(scene);
    dGeomSetPosition(geom, shift + x, y, z - shift);
  });
  return {"two clusters " + text(distance) + " apart", play, 1500, 3};
}

// Planes of paper in one another: extents of zero, bounds in common.
Bounds flatBox(Scene& scene, int) {
  Bounds bounds;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const dReal low = real(scene.random.below(8));
    bounds[2 * axis] = low;
    bounds[2 * axis + 1] = low + real(scene.random.below(2));
  }
  return bounds;
}

Bounds around(double x, double y, double z, double width, double depth, double height) {
  return {real(x - width / 2), real(x + width / 2),  real(y - depth / 2),
          real(y + depth / 2), real(z - height / 2), real(z + height / 2)};
}

// Log-uniform from the smallest denormal to 1e9, near the origin, where each size has company.
Bounds denormalTo1e9(Scene& scene, int) {
  Random& random = scene.random;
  const double low = std::log(double(kDenormal)), high = std::log(1e9);
  const double size = std::exp(random.between(low, high)), reach = 3 * size;
  const double x = random.between(-reach, reach), y = random.between(-reach, reach);
  const double z = random.between(-reach, reach), depth = size * random.between(0.1, 1);
  return around(x, y, z, size, depth, size * random.between(0.1, 1));
}

// Around the smallest normal number, where denormals begin.
Bounds aroundTheSmallestNormal(Scene& scene, int) {
  const double unit = static_cast<double>(std::numeric_limits<dReal>::min());
  const double x = unit * scene.random.between(-8, 8), y = unit * scene.random.between(-8, 8);
  const double z = unit * scene.random.between(-8, 8), size = unit * scene.random.between(0.5, 2);
  return around(x, y, z, size, size, size);
}

// Bars and plates: one extent, or two, 1e6 times the rest.
Play elongated(std::size_t long_axes) {
  return userBoxes(
      [long_axes](Scene& scene, int) {
        double extent[3] = {1, 1, 1};
        const std::size_t axis = scene.random.below(3);
        for (std::size_t i = 0; i < long_axes; ++i) extent[(axis + i) % 3] = 1e6;
        const double reach = scene.side * 4, x = scene.random.between(0, reach);
        const double y = scene.random.between(0, reach), z = scene.random.between(0, reach);
        return around(x, y, z, extent[0], extent[1], extent[2]);
      },
      0.5);
}

void largestAmongUnits(Scene&, int i, int frame, Bounds& bounds) {
  const dReal at = real(frame), reach = kLargest * real(i < 2 ? 1 : i < 4 ? 0.5 : 1e-3);
  if (i % 2)
    bounds = {-reach, reach, -reach, reach, -reach, reach};
  else if (frame == 0 || i > 0)
    bounds = {-reach, reach, 1, 2, -reach, reach};
  else
    bounds = {at, kLargest, -kLargest, at, at, at + 1};
}

// Infinite, NaN, inverted.

// Bounds are infinite where `low` and `high` say so; they change places with finite ones.
Play infinite(std::size_t first_axis, std::size_t last_axis, bool low, bool high) {
  return fewAmongUnitBoxes(8, [=](Scene&, int i, int frame, Bounds& bounds) {
    for (std::size_t axis = first_axis; axis <= last_axis && (i + frame) % 3; ++axis) {
      if (low) bounds[2 * axis] = -kInfinity;
      if (high) bounds[2 * axis + 1] = kInfinity;
    }
  });
}

Bounds nothingButInfinite(Scene& scene, int) {
  Bounds bounds = unitBounds(scene);
  const std::size_t axis = scene.random.below(3), which = 1 + scene.random.below(3);
  if (which & 1) bounds[2 * axis] = -kInfinity;
  if (which & 2) bounds[2 * axis + 1] = kInfinity;
  return bounds;
}

// Infinite sizes of ODE's own classes: some of their bounds are infinite, others NaN.
void infiniteClasses(Scene& scene, int frame) {
  if (frame == 0)
    for (const dGeomID geom :
         {dCreateSphere(nullptr, kInfinity), dCreateBox(nullptr, 1, kInfinity, 1),
          dCreateCapsule(nullptr, 1, kInfinity), dCreateRay(nullptr, kInfinity),
          dCreateSphere(nullptr, 1)})
      scene.marked.push_back(scene.take(geom));
  for (const dGeomID geom : scene.marked) placeAnywhere(scene, geom);
  dGeomSetPosition(scene.marked.back(), frame % 2 ? kInfinity : 1, frame % 3 ? -kInfinity : 1, 1);
}

// A NaN that comes and goes: frames 1 and 2 have it.
void nanSize(Scene&, int i, int frame, Bounds& bounds) {
  const std::size_t at = std::size_t(i) % 6;
  if (frame == 1 || frame == 2) bounds[at] = kNaN;
  if (i % 4 == 0) bounds[(at + 1) % 6] = i % 2 ? -kInfinity : kInfinity;
}

Bounds inverted(Scene& scene, int) {
  Bounds bounds = unitBounds(scene);
  const std::size_t axis = scene.random.below(3);
  if (scene.random.chance(0.3)) std::swap(bounds[2 * axis], bounds[2 * axis + 1]);
  if (scene.random.chance(0.1)) std::swap(bounds[0], bounds[1]);
  return bounds;
}

// Everything moves.

void acrossTheWorld(Scene& scene, dGeomID geom, int frame) {
  const double reach[] = {1, 1e3, 1e9, 1e25, 2, 1e6};
  const dReal x = between(scene, -1, 1) * real(reach[frame]), y = between(scene, -2, 2);
  dGeomSetPosition(geom, x, y, between(scene, -2, 2));
}

Bounds scaleFromFrameToFrame(Scene& scene, int frame) {
  const double scale[] = {1, 1e-30, 1e30, 1e-6, 1e12, 1};
  Bounds bounds;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = scene.random.between(0, scene.side);
    bounds[2 * axis] = real(low * scale[frame]);
    bounds[2 * axis + 1] = real((low + 1) * scale[frame]);
  }
  return bounds;
}

// Floating-point modes, denormals.

// Gaps and overlaps of some denormals, with some bounds that are none.
Play denormals(double others) {
  return userBoxes(
      [others](Scene& scene, int) {
        Bounds bounds;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const dReal low = real(scene.random.below(20)) - 10;
          bounds[2 * axis] = low * kDenormal;
          bounds[2 * axis + 1] = (low + real(scene.random.below(5))) * kDenormal;
          if (scene.random.chance(others)) bounds[2 * axis] = -1;
          if (scene.random.chance(others)) bounds[2 * axis + 1] = 1;
        }
        return bounds;
      },
      0.4);
}

// Bounds whose narrowing to float or whose differences overflow, infinite and NaN ones.
Bounds anyBounds(Scene& scene, int) {
  const dReal values[] = {-kInfinity, -kLargest,    -kLargest / 2, -1,        -kDenormal, 0,
                          1,          kLargest / 2, kLargest,      kInfinity, kDenormal};
  Bounds bounds = unitBounds(scene);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!scene.random.chance(0.1)) continue;
    bounds[2 * axis] = values[scene.random.below(11)];
    bounds[2 * axis + 1] = values[scene.random.below(11)];
  }
  if (scene.random.chance(0.02)) bounds[scene.random.below(6)] = kNaN;
  return bounds;
}

}  // namespace

std::vector<Extreme> extremes() {
  std::vector<Extreme> all;
  const auto add = [&](const std::string& name, const Play& play, std::size_t most = 5000,
                       int frames = 4) {
    all.push_back({name, play, most, frames});
  };
  for (const double distance : {1e6, 1e9, 1e12, 1e15, 1e18, 1e30})
    all.push_back(unitBoxesAt(distance));
  for (const double factor : {1e6, 1e12, 1e30})
    add("a scene " + text(factor) + " wide", boxes(denseCube, factor, 0, true), 5000, 2);
  const double largest = static_cast<double>(kLargest);
  add("a scene as wide as the type's largest number", boxes(denseCube, largest, 0, true), 5000, 2);
  add("a scene that reaches both ends of the type's range", boxes(denseCube, 2 * largest, 0, true),
      5000, 2);
  for (const double distance : {1e6, 1e12, 1e30}) all.push_back(clustersApart(distance));
  add("all boxes in one place", eachUnitBox([](Scene&, dGeomID geom, int frame) {
        dGeomSetPosition(geom, real(frame), 2, 3);
      }),
      700);
  add("a lattice that touches all over", boxes(touchingLattice, 1, 0), 5000, 2);
  // Steps that binary numbers do not have make it a matter of rounding which of them touch.
  add("a lattice of steps of 0.1", boxes(touchingLattice, 0.1, 0), 5000, 2);
  add("a lattice of steps of 0.1, 1e6 away", boxes(touchingLattice, 0.1, 1e6), 1500, 2);
  add("boxes without extent in a lattice", userBoxes(flatBox), 1500, 2);
  add("denormal to 1e9 in one scene", userBoxes(denormalTo1e9, 0.5), 1500);
  add("around the smallest normal number", userBoxes(aroundTheSmallestNormal, 0.5), 1500);
  add("bars 1e6 times as long as wide", elongated(1), 1500);
  add("plates 1e6 times as wide as thick", elongated(2), 700);
  add("boxes of the type's largest extent among unit boxes",
      fewAmongUnitBoxes(6, largestAmongUnits));

  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string along = std::string(" along ") + "xyz"[axis];
    add("half-infinite boxes down" + along, infinite(axis, axis, true, false));
    add("half-infinite boxes up" + along, infinite(axis, axis, false, true));
    add("infinite boxes" + along, infinite(axis, axis, true, true));
  }
  add("boxes infinite in all directions", infinite(0, 2, true, true));
  add("nothing but infinite boxes", userBoxes(nothingButInfinite), 700);
  add("ODE's classes with infinite sizes and places", onUnitBoxes(infiniteClasses));
  add("NaN bounds of user classes", fewAmongUnitBoxes(12, nanSize));
  add("inverted boxes", userBoxes(inverted, 0.5), 1500);

  add("geoms that cross the world in every frame", eachUnitBox(acrossTheWorld), 1500, 6);
  add("scales from 1e-30 to 1e30 from frame to frame", userBoxes(scaleFromFrameToFrame), 5000, 6);
  add("denormal coordinates only", denormals(0), 1500);
  add("bounds of every kind", userBoxes(anyBounds, 0.3));
  if (!FloatingPointMode::kCanBeSet) return all;
  // User boxes, or boxes whose bounds no mode rounds otherwise: ODE's own computations are the
  // program's matter in any mode.
  const Play unit_boxes =
      eachUnitBox([](Scene& scene, dGeomID geom, int) { placeAnywhere(scene, geom); });
  const auto addIn = [&](unsigned mode, const char* name, const Play& play, std::size_t most) {
    add(name, play, most);
    all.back().mode = mode;
  };
  addIn(FloatingPointMode::kFlushing, "denormals flushed (-ffast-math)", denormals(0.2), 700);
  addIn(FloatingPointMode::kDownward, "rounding downward", unit_boxes, 5000);
  addIn(FloatingPointMode::kUpward, "rounding upward", unit_boxes, 5000);
  addIn(FloatingPointMode::kTowardZero, "rounding toward zero", unit_boxes, 5000);
  addIn(FloatingPointMode::kTrapping, "invalid operations and overflows trap",
        userBoxes(anyBounds, 0.3), 1500);
  return all;
}

}  // namespace sap_test
