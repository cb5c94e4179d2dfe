// Sizes, places far away, bodies that begin within each other, and shapes that are hard to touch.
#include <cmath>

#include "extreme.h"

namespace sap_test::physics {

namespace {

void smallOnLarge(Stage& stage) {
  stage.plane();
  stack(stage, 1, 1000);
  stack(stage, 3, 0.001, {0, 0, 1000});
}

void largeOnSmall(Stage& stage) {
  stage.plane();
  for (int i = 0; i < 9; ++i) stack(stage, 1, 1, {i % 3 * 400 - 400.0, i / 3 * 400 - 400.0, 0});
  stack(stage, 1, 1000, {0, 0, 1});
}

void stackOnSlab(Stage& stage, double from) {
  stage.block({from, 0, -5}, {100, 100, 10});
  stack(stage, 5, 1, {from, 0, 0});
}

Extreme farAway(double distance, bool grown) {
  Extreme extreme{"places",
                  "a stack of 5, " + shortNumber(distance) + " m away, " +
                      (grown ? "built there" : "moved there"),
                  Demand::stand, [=](Stage& stage) { stackOnSlab(stage, grown ? distance : 0); }};
  if (!grown) {
    extreme.drive = [distance](Stage& stage, int step) {
      if (step == 100) stage.move({distance, 0, 0});
    };
  }
  return extreme;
}

Extreme within(const char* name, std::function<void(Stage&)> build) {
  return {"overlap at the start", name, Demand::settle, std::move(build), 1, 800, isBelowFloor};
}

// A sheet of triangles in the plane z = 0.
dGeomID sheet(Stage& stage, int cells, const Vec& side) {
  std::vector<dReal> vertices;
  std::vector<dTriIndex> triangles;
  const auto at = [cells](int i, int j) { return static_cast<dTriIndex>(j * (cells + 1) + i); };
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      vertices.insert(vertices.end(), {static_cast<dReal>(side[0] * (double(i) / cells - 0.5)),
                                       static_cast<dReal>(side[1] * (double(j) / cells - 0.5)), 0});
      if (i == cells || j == cells) continue;
      for (const dTriIndex corner :
           {at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)}) {
        triangles.push_back(corner);
      }
    }
  }
  return stage.mesh(vertices, triangles);
}

void largeSheet(Stage& stage) {
  sheet(stage, 10, {20, 20, 0});
}

void degenerate(Stage& stage) {
  largeSheet(stage);
  // The same sheet of points, lines and triangles of which two corners are one.
  std::vector<dReal> vertices;
  std::vector<dTriIndex> triangles;
  for (int i = 0; i <= 20; ++i) {
    vertices.insert(vertices.end(), {static_cast<dReal>(i - 10), 0, 0});
    const dTriIndex here = static_cast<dTriIndex>(i), first = 0;
    triangles.insert(triangles.end(), {here, here, here});
    triangles.insert(triangles.end(), {first, here, here});
    triangles.insert(triangles.end(), {first, static_cast<dTriIndex>(i / 2), here});
  }
  stage.mesh(vertices, triangles);
  stage.box({0, 0, 1}, {1, 1, 1});
}

Extreme shape(const char* name, double unit, std::function<void(Stage&)> build, int steps = 600) {
  return {"shapes", name, Demand::settle, std::move(build), unit, steps, isBelowFloor};
}

constexpr int kSamples = 33;
constexpr double kCliff = 100;  // metres

dReal cliffs(void*, int x, int z) {
  return static_cast<dReal>((x / 8 + z / 8) % 2 ? kCliff : 0);
}

// Flat squares of 8 m, every other one a hundred metres higher; balls roll over the edges.
void heightfield(Stage& stage, bool boxes) {
  const dHeightfieldDataID data = dGeomHeightfieldDataCreate();
  stage.own(std::shared_ptr<void>(data, [](void* heights) {
    dGeomHeightfieldDataDestroy(static_cast<dHeightfieldDataID>(heights));
  }));
  dGeomHeightfieldDataBuildCallback(data, nullptr, cliffs, kSamples - 1, kSamples - 1, kSamples,
                                    kSamples, 1, 0, 1, 0);
  dGeomHeightfieldDataSetBounds(data, 0, static_cast<dReal>(kCliff));
  const dGeomID field = stage.take(dCreateHeightfield(stage.space(), data, 1));
  dMatrix3 upright;
  dRFromAxisAndAngle(upright, 1, 0, 0, dReal(1.5707963267948966));
  dGeomSetRotation(field, upright);
  for (int i = 0; i < 9; ++i) {
    const Vec at = {i % 3 * 8 - 8.5, i / 3 * 8 - 8.5, kCliff + 1};
    if (boxes) {
      stage.box(at, {0.6, 0.6, 0.6});
    } else {
      stage.ball(at, 0.3);
    }
    stage.push(stage.bodies().size() - 1, {2, 1, 0});
    dBodySetLinearDamping(stage.bodies().back(), dReal(0.001));
    dBodySetAngularDamping(stage.bodies().back(), dReal(0.01));
  }
}

}  // namespace

Extremes sizes() {
  Extremes extremes;
  for (const double side : {0.001, 0.01, 100.0, 1000.0})
    extremes.push_back({"sizes", "a stack of 5, sides of " + shortNumber(side) + " m",
                        Demand::stand, stackOnPlane(5, side), side});
  extremes.push_back({"sizes", "boxes of 1 mm on one of 1 km", Demand::stand, smallOnLarge, 0.001});
  extremes.push_back({"sizes", "a box of 1 km on nine of 1 m", Demand::stand, largeOnSmall});
  return extremes;
}

Extremes places() {
  Extremes extremes;
  for (const double distance : {1e3, 1e5, 1e6, 1e9, 1e12})
    for (const bool grown : {false, true}) extremes.push_back(farAway(distance, grown));
  return extremes;
}

Extremes overlaps() {
  return {within("two boxes half within each other",
                 [](Stage& stage) {
                   stackOnPlane(1)(stage);
                   stack(stage, 1, 1, {0.1, 0.05, 0.5});
                 }),
          within("27 boxes in one place",
                 [](Stage& stage) {
                   stage.plane();
                   for (int i = 0; i < 27; ++i) stack(stage, 1, 1);
                 }),
          within("a box nine tenths below the floor",
                 [](Stage& stage) {
                   stage.plane();
                   stack(stage, 1, 1, {0, 0, -0.9});
                 }),
          within("a ball in the middle of a fixed box",
                 [](Stage& stage) {
                   stage.plane();
                   stage.block({0, 0, 2}, {2, 2, 4});
                   stage.ball({0, 0, 2}, 0.3);
                 }),
          within("a box across a mesh of one sheet", [](Stage& stage) {
            largeSheet(stage);
            stage.box({0.3, 0.3, 0.1}, {1, 1, 1});
          })};
}

Extremes shapes() {
  return {shape("a box on a mesh of one sheet", 1,
                [](Stage& stage) {
                  largeSheet(stage);
                  stage.box({0.3, 0.2, 1}, {1, 1, 1});
                }),
          shape("a ball of 0.1 m that falls for 50 m onto a sheet", 0.1,
                [](Stage& stage) {
                  largeSheet(stage);
                  stage.ball({0.3, 0.2, 50}, 0.1);
                }),
          shape("a box on a mesh with triangles of no area", 1, degenerate),
          shape("a box on triangles of 1 mm by 20 m", 1,
                [](Stage& stage) {
                  sheet(stage, 20, {0.02, 20, 0});
                  stage.block({0, 0, -0.5}, {20, 20, 0.99});
                  stage.box({0, 0, 1}, {1, 1, 1});
                }),
          shape("a plate of 10 m by 1 mm", 0.001,
                [](Stage& stage) {
                  stage.plane();
                  stage.box({0, 0, 0.5}, {10, 10, 0.001}, 8000);
                  stage.turn(0, {0, 1, 0}, 0.05);
                }),
          shape(
              "balls over cliffs of a heightfield", 0.6,
              [](Stage& stage) { heightfield(stage, false); }, 1500),
          shape(
              "boxes over cliffs of a heightfield", 0.6,
              [](Stage& stage) { heightfield(stage, true); }, 1500)};
}

// Speeds, masses and lengths around the smallest normal number; a mode that flushes what is less.
Extremes modes() {
  const double tiny = sizeof(dReal) == 8 ? 1e-308 : 1e-38;
  const double speck = sizeof(dReal) == 8 ? 1e-60 : 1e-6;
  const Extreme all[] = {{"denormals", "a stack of 5", Demand::stand, stackOnPlane(5)},
                         {"denormals", "a ball that turns at a denormal speed", Demand::conserve,
                          [tiny](Stage& stage) {
                            stage.noGravity();
                            stage.ball({}, 0.5);
                            stage.spin(0, {0, 0, tiny / 16});
                          }},
                         {"denormals", "boxes of " + shortNumber(speck) + " m one on the other",
                          Demand::stand, stackOnPlane(3, speck), speck}};
  Extremes extremes;
  for (const Extreme& extreme : all) {
    if (&extreme != all) extremes.push_back(extreme);  // the stack is no extreme by itself
    extremes.push_back(extreme);
    extremes.back().name += ", denormals flushed";
    extremes.back().mode = FloatingPointMode::kFlushing;
  }
  return extremes;
}

}  // namespace sap_test::physics
