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
