// Mass ratios, stacks and what is built of many bodies.
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>

#include "extreme.h"

namespace sap_test::physics {

namespace {

constexpr double kPi = 3.14159265358979323846;

std::string power(int exponent) {
  return "1:10^" + std::to_string(exponent);
}

Extreme heavyOnLight(double ratio, const std::string& text) {
  return {"mass ratios", "a box on one as large, " + text + " of its mass", Demand::stand,
          [ratio](Stage& stage) {
            stackOnPlane(1)(stage);
            stack(stage, 1, 1, {0, 0, 1}, 1000 * ratio);
          }};
}

Extreme lightOnHeavy(int exponent) {
  return {"mass ratios", "the same, the light one on top, " + power(exponent), Demand::stand,
          [exponent](Stage& stage) {
            stage.plane();
            stack(stage, 1, 1, {}, 1000 * std::pow(10.0, exponent));
            stack(stage, 1, 1, {0, 0, 1});
          }};
}

void alternating(Stage& stage) {
  stage.plane();
  for (int i = 0; i < 6; ++i) stack(stage, 1, 1, {0, 0, double(i)}, i % 2 ? 10000 : 10);
}

void wall(Stage& stage) {
  stage.plane();
  for (int row = 0; row < 10; ++row) {
    for (int i = 0; i < 8; ++i) {
      stage.box({0.4 * i + 0.2 * (row % 2), 0, 0.2 * (row + 0.5)}, {0.4, 0.2, 0.2}, 2000);
    }
  }
}

void pyramid(Stage& stage) {
  stage.plane();
  for (int row = 0; row < 10; ++row) {
    for (int i = 0; i < 10 - row; ++i) {
      stage.box({1.05 * (i + 0.5 * row), 0, row + 0.5}, {1, 1, 1});
    }
  }
}

void blocks(Stage& stage) {  // 18 floors of three, as in the game
  stage.plane();
  for (int row = 0; row < 18; ++row) {
    for (int i = -1; i <= 1; ++i) {
      const double z = 0.015 * (row + 0.5);
      if (row % 2) {
        stage.box({0.025 * i, 0, z}, {0.025, 0.075, 0.015}, 600);
      } else {
        stage.box({0, 0.025 * i, z}, {0.075, 0.025, 0.015}, 600);
      }
    }
  }
}

// Cards of 90 by 60 by 1 mm that lean on each other, their feet on the floor and their tops in
// touch.
void leaningPair(Stage& stage, double x, double floor) {
  constexpr double height = 0.09, thick = 0.001, lean = 0.3;
  const double across = height / 2 * std::sin(lean) + thick / 2 * std::cos(lean);
  const double up = height / 2 * std::cos(lean) + thick / 2 * std::sin(lean);
  for (const int side : {-1, 1}) {
    stage.box({x + side * across, 0, floor + up}, {thick, 0.06, height}, 700);
    stage.turn(stage.bodies().size() - 1, {0, 1, 0}, -side * lean);
  }
}

void cardHouse(Stage& stage, int floors) {
  stage.friction = 1;
  stage.plane();
  const double width = 2 * (0.09 * std::sin(0.3) + 0.001 * std::cos(0.3));
  const double storey = 0.09 * std::cos(0.3) + 0.001 * std::sin(0.3);
  double floor = 0;
  for (int level = 0; level < floors; ++level) {
    const int pairs = floors - level;
    for (int i = 0; i < pairs; ++i) leaningPair(stage, width * (i - 0.5 * (pairs - 1)), floor);
    floor += storey;
    if (pairs > 1) {
      stage.box({0, 0, floor + 0.0005}, {width * pairs - 0.02, 0.06, 0.001}, 700);
      floor += 0.001;
    }
  }
}

// A wedge between two angles and two radii about the y axis, as a convex hull about its middle.
struct Wedge {
  dReal points[24];
  dReal planes[24];
  // Corners of each face, counted before; bit 0 of a corner is its radius, 1 its angle, 2 its y.
  unsigned faces[30] = {4, 0, 4, 6, 2, 4, 1, 3, 7, 5, 4, 0, 1, 5, 4,
                        4, 2, 6, 7, 3, 4, 0, 2, 3, 1, 4, 4, 5, 7, 6};

  const dReal* point(unsigned corner) const { return points + std::size_t{3} * corner; }

  // The plane of a face, whose corners then go round it to the left, seen from outside.
  void close(int face) {
    unsigned* const corners = faces + 5 * face + 1;
    dReal* const plane = planes + 4 * face;
    dVector3 u, v, normal;
    dSubtractVectors3(u, point(corners[1]), point(corners[0]));
    dSubtractVectors3(v, point(corners[2]), point(corners[0]));
    dCalcVectorCross3(normal, u, v);
    dNormalize3(normal);
    plane[3] = dCalcVectorDot3(normal, point(corners[0]));
    if (plane[3] < 0) {
      std::swap(corners[1], corners[3]);
      dNegateVector3(normal);
      plane[3] = -plane[3];
    }
    dCopyVector3(plane, normal);
  }
};

// The same faces as triangles.
dGeomID wedgeOfTriangles(Stage& stage, const Wedge& wedge) {
  std::vector<dTriIndex> triangles;
  for (int face = 0; face < 6; ++face) {
    const unsigned* const corners = wedge.faces + 5 * face + 1;
    for (const int corner : {0, 1, 2, 0, 2, 3}) {
      triangles.push_back(static_cast<dTriIndex>(corners[corner]));
    }
  }
  return stage.mesh({std::begin(wedge.points), std::end(wedge.points)}, triangles);
}

void wedge(Stage& stage, double from, double to, bool of_triangles) {
  const auto wedge = std::make_shared<Wedge>();
  stage.own(wedge);
  const double middle = (from + to) / 2, radius = 2.25;
  const Vec centre = {radius * std::cos(middle), 0, radius * std::sin(middle)};
  for (int i = 0; i < 8; ++i) {
    const double r = i & 1 ? 2.5 : 2, angle = i & 2 ? to : from, y = i & 4 ? 0.5 : -0.5;
    wedge->points[3 * i] = static_cast<dReal>(r * std::cos(angle) - centre[0]);
    wedge->points[3 * i + 1] = static_cast<dReal>(y);
    wedge->points[3 * i + 2] = static_cast<dReal>(r * std::sin(angle) - centre[2]);
  }
  for (int face = 0; face < 6; ++face) wedge->close(face);
  dMass mass;
  dMassSetBox(&mass, 2000, dReal(0.5), 1, static_cast<dReal>(radius * (to - from)));
  const dGeomID geom = of_triangles ? wedgeOfTriangles(stage, *wedge)
                                    : stage.take(dCreateConvex(stage.space(), wedge->planes, 6,
                                                               wedge->points, 8, wedge->faces));
  stage.body(geom, mass, centre);
}

void arch(Stage& stage, bool of_triangles) {
  stage.plane();
  constexpr int stones = 11;
  for (int i = 0; i < stones; ++i)
    wedge(stage, kPi * i / stones, kPi * (i + 1) / stones, of_triangles);
}

void ballsOnBalls(Stage& stage) {
  stage.plane();
  for (int i = 0; i < 10; ++i) stage.ball({0, 0, 0.5 + i}, 0.5);
}

void logs(Stage& stage) {
  stage.plane();
  for (const int side : {-1, 1}) stage.block({side * 2.65, 0, 1}, {0.3, 6, 2});
  for (int row = 0; row < 5; ++row) {
    for (int i = 0; i < 5 - row; ++i) {
      stage.rod({i + 0.5 * row - 2, 0, 0.5 + row * std::sqrt(0.75)}, 0.5, 4);
      stage.turn(stage.bodies().size() - 1, {1, 0, 0}, kPi / 2);
    }
  }
}

void ruler(Stage& stage) {  // sticks out by nine tenths of what would tip it
  stage.block({0, 0, 0.5}, {1, 1, 1});
  stage.box({0.45, 0, 1.01}, {1, 0.1, 0.02});
}

}  // namespace

Extremes masses() {
  Extremes extremes;
  for (const int ratio : {3, 10, 30}) {
    extremes.push_back(heavyOnLight(ratio, "1:" + std::to_string(ratio)));
  }
  for (const int exponent : {2, 4, 6}) {
    extremes.push_back(heavyOnLight(std::pow(10.0, exponent), power(exponent)));
  }
  for (const int exponent : {4, 6}) extremes.push_back(lightOnHeavy(exponent));
  extremes.push_back({"mass ratios", "six boxes, 1:1000 by turns", Demand::stand, alternating});
  return extremes;
}

Extremes structures() {
  Extremes extremes;
  for (const int count : {3, 5, 7, 10, 15, 20, 50, 100})
    extremes.push_back(
        {"structures", "a stack of " + std::to_string(count), Demand::stand, stackOnPlane(count)});
  const auto add = [&extremes](const char* name, double unit, std::function<void(Stage&)> build) {
    extremes.push_back({"structures", name, Demand::stand, std::move(build), unit});
  };
  add("a wall of 10 by 8 bricks", 0.2, wall);
  add("a pyramid of ten rows", 1, pyramid);
  add("18 floors of three blocks, 15 mm high", 0.015, blocks);
  add("two leaning cards", 0.09, [](Stage& stage) { cardHouse(stage, 1); });
  add("a card house of three storeys", 0.09, [](Stage& stage) { cardHouse(stage, 3); });
  add("an arch of 11 convex stones", 0.5, [](Stage& stage) { arch(stage, false); });
  add("an arch of 11 stones of triangles", 0.5, [](Stage& stage) { arch(stage, true); });
  add("ten balls one on the other", 1, ballsOnBalls);
  add("fifteen logs between posts", 1, logs);
  add("a ruler over the edge", 0.1, ruler);
  return extremes;
}

std::string shortNumber(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", number);
  return text;
}

bool isBelowFloor(const Stage& stage, std::size_t body) {
  return stage.place(body)[2] < -0.5;
}

void stack(Stage& stage, int count, double side, const Vec& foot, double density) {
  for (int i = 0; i < count; ++i) {
    stage.box({foot[0], foot[1], foot[2] + side * (i + 0.5)}, {side, side, side}, density);
  }
}

std::function<void(Stage&)> stackOnPlane(int count, double side) {
  return [count, side](Stage& stage) {
    stage.plane();
    stack(stage, count, side);
  };
}

const Extremes& extremes() {
  static const Extremes all = [] {
    Extremes extremes;
    for (const auto& theme : {masses, structures, speeds, steps, sizes, places, overlaps, shapes,
                              joints, spins, longRuns, modes}) {
      for (Extreme& extreme : theme()) extremes.push_back(std::move(extreme));
    }
    return extremes;
  }();
  return all;
}

}  // namespace sap_test::physics
