// What swept contacts do to fast bodies, beside dCollide at the same step of 10 ms.
#include <algorithm>
#include <cmath>

#include "extreme.h"

namespace sap_test::physics {
namespace {

constexpr double kStep = 0.01, kRadius = 0.1;

double around(int run) {  // -1 to 1
  return 2 * phaseOf(7 * run + 3) - 1;
}

// Smooth bodies in no gravity, unless it is said otherwise.
struct Flight : Stage {
  Flight(const Setting& setting, const Things& things, const Vec& gravity = {})
      : Stage(Pairing::ours, setting, kStep, gravity) {
    friction = 0;
    add(things);
  }
  void fly(double steps) {
    for (int i = 0; i < static_cast<int>(steps); ++i) step();
  }
};

Thing ball(const Vec& at, const Vec& speed = {}, double radius = kRadius, double density = 1000) {
  return {Thing::ball, at, {radius}, density, speed};
}
Thing fixed(const Vec& at, const Vec& sides) {
  return {Thing::fixed, at, sides};
}

Quantity happens(const char* what, bool does) {
  return {what, double(does), 0, 0};
}

// Straight or aslant. The closed form: friction acts until the ball rolls.
Quantities bounceOff(const Setting& setting, int run, double diameters, double degrees) {
  const double speed = diameters * 2 * kRadius / kStep, side = std::sin(degrees * kPi / 180);
  const double down = std::sqrt(1 - side * side), way = speed * down * kStep;
  Flight flight(setting, {fixed({3, 0, 0}, {1, 900, 9}),
                          ball({phaseOf(run) - way, 0, 0}, {speed * down, speed * side, 0})});
  flight.bounce = 0.8;
  flight.friction = 0.6;
  flight.fly(4 / way + 3);
  const double along = side - std::min(0.6 * 1.8 * down, side * 2 / 7);
  return {{"speed after", -flight.speed(0)[0] / speed, 0.8 * down, 0.8 * down},
          {"speed along it", flight.speed(0)[1] / speed, along, 1}};
}

// Or falls on them aslant, with the spin of a ball that rolls.
Quantities rollOverTiles(const Setting& setting, int run, double width, double speed, double down) {
  Flight flight(setting, {}, {0, 0, -kGravity});
  for (int i = -1; i * width < 14; ++i) flight.add(fixed({width * i, 0, -0.05}, {width, 4, 0.1}));
  flight.friction = 0.8;
  const double height = kRadius + down * kStep * (1 + phaseOf(3 * run));
  flight.add(ball({phaseOf(run), 0.3, height}, {speed, 0, -down}));
  flight.spin(0, {0, speed / kRadius, 0});
  double top = 0;
  for (int i = 0; i < (down > 0 ? 5 : 12 / (speed * kStep)); ++i) {
    flight.step();
    top = std::max(top, flight.place(0)[2] - kRadius);
  }
  if (down > 0) return {happens("slows by 5 %", flight.speed(0)[0] < 0.95 * speed)};
  return {happens("hops by 1 cm", top > 0.01)};
}

Quantities rollInRoom(const Setting& setting, int run, double bounce) {
  Flight flight(setting, {}, {0, 0, -kGravity});
  std::vector<Vec> corners;
  for (int i = 0; i < 8; ++i)
    corners.push_back({i & 1 ? 2.0 : -2.0, i & 2 ? 2.0 : -2.0, i & 4 ? 2.0 : -2.0});
  flight.mesh(corners, {0, 1, 3, 0, 3, 2, 4, 7, 5, 4, 6, 7, 0, 5, 1, 0, 4, 5,
                        2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 7, 3, 1, 5, 7});
  const double angle = 2 * kPi * phaseOf(run), speed = 15 * (1 + run % 5);
  flight.add(ball({0, 0, kRadius - 2}, {speed * std::cos(angle), speed * std::sin(angle), 0}));
  flight.bounce = bounce;
  flight.fly(200);
  const auto [x, y, z] = flight.place(0);
  return {happens("leaves", std::max({std::fabs(x), std::fabs(y), std::fabs(z)}) > 2)};
}

Quantities bounceBetween(const Setting& setting, int run) {
  Flight flight(setting, {fixed({-0.275, 0, 0}, {0.05, 99, 9}), fixed({0.275, 0, 0}, {0.05, 99, 9}),
                          ball({0.14 * around(run), 0, 0}, {60, 0, 0})});
  flight.bounce = 0.8;
  flight.fly(50);
  return {happens("leaves", std::fabs(flight.place(0)[0]) > 0.25)};
}

// A wall at 45 degrees to the way of a ball, and another one behind it in this way.
Quantities hitBehind(const Setting& setting, int run) {
  const double x = 2 * phaseOf(run) - 2;
  Flight flight(setting, {fixed({3, 0, 0}, {0.2, 30, 9}), ball({x, x, 0}, {150, 150, 0}),
                          ball({3.5, 3.5 + 0.1 * around(run), 0})});
  flight.fly(10);
  return {happens("moves", length(flight.speed(1)) > 1)};
}

// Against steps 400 times smaller: the part of its speed that the ball has too much or lacks. An
// elastic rebound from the depth of an impact is not counted.
Quantities flyAt(const Setting& setting, int run, const Things& walls) {
  const double speeds[] = {50, 200, 400}, speed = speeds[run % 3];
  const auto play = [&](const Setting& how) {
    Flight flight(how, walls);
    flight.add(ball({-1 - speed * kStep * phaseOf(run), 0, 0}, {speed, 0, 0}));
    flight.fly(6 / (speed * kStep) + 3);
    Vec found = flight.speed(0);
    found[0] = std::max(found[0], 0.0);
    return found;
  };
  Setting fine;
  fine.divide = 400;
  return {{"speed", length(minus(play(setting), play(fine))), 0, speed}};
}

// At 200 m/s at a shelf of 50 mm below; whether it passes.
Quantities fallOnShelf(const Setting& setting, int run, double angle, const Vec& spin, char of) {
  const double way = 3 + 2 * phaseOf(run), side = std::sin(angle), down = std::cos(angle);
  Flight flight(setting, {}, {0, 0, -kGravity});
  if (of == 'o') {  // a geom beside its body's centre
    dMass mass;
    dMassSetSphere(&mass, 1000, real(kRadius));
    const dGeomID geom = flight.take(dCreateSphere(flight.space(), real(kRadius)));
    flight.body(geom, mass, {0, 0, way});
    dGeomSetOffsetPosition(geom, real(0.05), 0, real(-0.05));
  } else {
    flight.add(ball({-side * way, 0, down * way}));
  }
  flight.push(0, 200 * Vec{side, 0, -down});
  flight.spin(0, spin);
  const Vec at = {0, 0, -0.025}, sides = {400, 400, 0.05};
  if (of == 'm') flight.mesh({{-200, -200, 0}, {200, -200, 0}, {0, 400, 0}}, {0, 1, 2});
  if (of == 'k') dBodySetKinematic(flight.add({Thing::box, at, sides}));
  if (of == 's' || of == 'o') flight.add(fixed(at, sides));
  flight.friction = 0.8;
  flight.fly(100);
  return {happens("passes", flight.place(0)[2] < 0 || flight.place(0)[2] > 3)};
}

// A rod of 4 mm and 1 m, turned anyhow, at a sheet of triangles; whether it passes.
Quantities rodAtSheet(const Setting& setting, int run, double spin) {
  Flight flight(setting,
                {{Thing::box, {0, 0, 2 + phaseOf(run)}, {0.004, 0.004, 1}, 8000, {0, 0, -30}}});
  flight.turn(0, {std::cos(9.0 * run), std::sin(9.0 * run), 0}, kPi * phaseOf(3 * run + 1));
  flight.spin(0, spin * Vec{around(run + 1), around(run + 2), around(run + 3)});
  flight.mesh({{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, {0, 1, 2, 0, 2, 3});
  flight.fly(60);
  return {happens("passes", flight.place(0)[2] < 0)};
}

// The closed form: smooth balls that are inelastic along the line of their centres. By the part of
// the blow that is wrong, the spin, and whether they pass with less than 1/20 of the blow.
Quantities meetInFlight(const Setting& setting, int run, double ratio, double diameters) {
  const double speed = diameters * 2 * kRadius / kStep, off = 0.12 * around(run);
  const double angle = kPi * (1 + run % 3) / 3;  // between their ways
  const Vec one = {speed, 0, 0}, two = {speed * std::cos(angle), speed * std::sin(angle), 0};
  const Vec relative = minus(one, two);
  const Vec across = off / length(relative) * Vec{-relative[1], relative[0], 0};
  const double before =
      std::max(kStep * (0.3 + 2.7 * phaseOf(run)), 2.2 * kRadius / length(relative));
  const double along = std::sqrt(4 * kRadius * kRadius - off * off);
  const Vec normal = 1 / (2 * kRadius) * minus(-along / length(relative) * relative, across);
  Flight flight(setting, {ball(-before * one, one),
                          ball(minus(across, before * two), two, kRadius, 1000 * ratio)});
  flight.fly(before / kStep + 4);
  const double blow = dot(relative, normal) / (1 + 1 / ratio);
  const Vec change = minus(flight.speed(0), one);
  const double spin = std::max(length(flight.rate(0)), length(flight.rate(1))) * kRadius / speed;
  return {{"blow", length(change + blow * normal), 0, std::fabs(blow)},
          {"spin", spin, 0, 1},
          happens("passes", length(change) < 0.05 * std::fabs(blow))};
}

// A ball strikes one of half its size that rests before a wall of 50 mm; whether one passes it.
Quantities strike(const Setting& setting, int run, double ratio, double speed, double distance) {
  Flight flight(setting, {fixed({3, 0, 0}, {0.05, 9, 9}),
                          ball({-2.5 + 2 * phaseOf(run), 0, 0}, {speed, 0, 0}),
                          ball({3 - distance, 0.03 * around(run), 0}, {}, 0.05, 8000 * ratio)});
  flight.fly((8 / speed + 0.1) / kStep);
  return {happens("passes", flight.place(0)[0] > 3 || flight.place(1)[0] > 3)};
}

// A kinematic bat that turns by radians a step.
Quantities swing(const Setting& setting, int run, bool beyond) {
  Flight flight(setting, {{Thing::box, {}, {2, 0.05, 0.05}}});
  dBodySetKinematic(flight[0]);
  flight.turn(0, {0, 0, 1}, 6.28 * phaseOf(run));
  flight.spin(0, {0, 0, 100.0 * (1 + run % 3)});
  flight.add(ball({beyond ? 1.02 + kRadius + 0.001 : 0.8, 0, 0}));
  flight.fly(4);
  return {happens(beyond ? "strikes beyond its end" : "misses",
                  (length(flight.speed(1)) > 1) == beyond)};
}

}  // namespace

std::vector<Scene> sweptScenes() {
  using std::bind;
  using namespace std::placeholders;
  std::vector<Scene> all;
  const auto add = [&all](const std::string& name, int runs,
                          std::function<Quantities(const Setting&, int)> play,
                          std::vector<Bound> bounds) {
    all.push_back(
        {name, "ball of 0.2 m, 10 ms", std::move(play), Scene::swept, runs, std::move(bounds)});
  };
  for (const double degrees : {0.0, 20.0, 45.0, 70.0})
    for (const double diameters : {0.6, 1.0, 2.0, 5.0, 10.0})
      add("restitution 0.8, friction 0.6, 0.6 to 10 diameters: " + text(diameters) + ", " +
              text(degrees) + " degrees",
          50, bind(bounceOff, _1, _2, diameters, degrees),
          {{"speed after", 0, 0.02, 0.02}, {"speed along it", 0, 0.05, 0.05}});
  // As dCollide, and one of forty more.
  for (const auto& [width, speed, most] :
       {Vec{0.1, 20, 0.175}, Vec{0.1, 40, 0.2}, Vec{0.1, 60, 0.2}, Vec{0.25, 40, 0.275},
        Vec{0.5, 12, 0.1}, Vec{0.5, 60, 0.15}})
    add("rolls over tiles of 0.1 to 0.5 m, 12 to 60 m/s: " + text(width) + ", " + text(speed), 40,
        bind(rollOverTiles, _1, _2, width, speed, 0), {{"hops by 1 cm", 0, most + 0.026}});
  for (const double down : {15, 40})
    add("falls aslant on tiles of 0.5 m, 43 or 57 m/s: " + text(down), 40,
        bind(rollOverTiles, _1, _2, 0.5, 40, down), {{"slows by 5 %", 0.3, 1}});
  for (const double bounce : {0.0, 0.8})
    add("rolls in a room of one mesh, 15 to 75 m/s: " + text(bounce), 100,
        bind(rollInRoom, _1, _2, bounce), {{"leaves", 0, 0.02}});
  add("restitution 0.8, walls 0.5 m apart, 60 m/s", 100, bounceBetween, {{"leaves", 0.5, 1.01}});
  add("a ball behind a wall hit aslant", 100, hitBehind, {{"moves", 0.3, 1}});
  Things shelves, holes;
  for (int i = 0; i < 5; ++i) {
    if (i < 3) shelves.push_back(fixed({0.3 * i, 0, 0}, {0.005, 4, 4}));
    for (const int side : {-1, 1}) {
      holes.push_back(fixed({0.7 * i, side * 1.11, 0}, {0.02, 2, 4}));
      holes.push_back(fixed({0.7 * i, 0, side * 1.11}, {0.02, 0.22, 2}));
    }
  }
  const auto wall = [&](const std::string& name, double most, const Things& walls) {
    add(name, 24, bind(flyAt, _1, _2, walls), {{"speed", 0, most, most}});
  };
  const std::string thin = "shelves, holes, posts, edges, 50 to 400 m/s: ";
  wall(thin + "three shelves of 5 mm", 1e-4, shelves);
  wall(thin + "five plates with holes of 1.1 diameters", 1e-4, holes);
  wall(thin + "an edge, 2 mm clear", 1e-6, {fixed({0, 1.102, 0}, {0.5, 2, 4})});
  wall("an edge 2 mm in its way, 50 to 400 m/s", 0.25, {fixed({0, 1.098, 0}, {0.5, 2, 4})});
  wall(thin + "a post of 1 cm", 1e-6, {fixed({}, {0.01, 0.01, 4})});
  wall(thin + "a post of 1 cm, 2 mm clear", 1e-4, {fixed({0, 0.107, 0}, {0.01, 0.01, 4})});
  const auto shelf = [&](const std::string& name, double angle, const Vec& spin, char of) {
    add("a shelf of 50 mm, six ways, 200 m/s: " + name, 24,
        bind(fallOnShelf, _1, _2, angle, spin, of), {{"passes", 0, 0}});
  };
  shelf("straight", 0, {}, 's');
  shelf("aslant", 1, {}, 's');
  shelf("aslant, turning", 0.5, {300, 200, 100}, 's');
  shelf("of triangles", 0.3, {}, 'm');
  shelf("of a kinematic body", 0, {}, 'k');
  shelf("a geom beside its body's centre", 0, {}, 'o');
  for (const double spin : {0.0, 100.0})
    add("a rod of 4 mm at triangles, 30 m/s, 0 or 100 rad/s: " + text(spin), 100,
        bind(rodAtSheet, _1, _2, spin), {{"passes", 0, spin > 0 ? 0.1 : 0}});
  for (const bool beyond : {false, true})
    add("a bat at 100 to 300 rad/s", 24, bind(swing, _1, _2, beyond),
        {{beyond ? "strikes beyond its end" : "misses", 0, 0}});
  for (const int ratio : {1, 10, 1000})
    for (const int diameters : {3, 10})
      add("meets a free ball, 3 to 10 diameters: 1:" + text(ratio) + ", " + text(diameters), 100,
          bind(meetInFlight, _1, _2, ratio, diameters),
          {{"blow", 0, 0.2, 1}, {"spin", 0, 0.05, 0.2}, {"passes", 0, 0}});
  const struct {
    double ratio, speed, distance, most;
  } struck[] = {{1, 40, 0.5, 0},    {1, 100, 1.2, 0.1}, {10, 100, 0.2, 0},
                {1, 100, 0.2, 0.9}, {1, 100, 0.5, 0.6}, {0.1, 100, 0.5, 0.9}};
  for (const auto& s : struck)
    add("strikes a ball before a wall, " +
            std::string(s.most > 0.1 ? "100 m/s, 0.2 to 0.5 m" : "40 m/s, 1.2 m or 1:10") + ": " +
            text(s.distance) + " m, " + text(s.speed) + " m/s, 1:" + text(s.ratio),
        100, bind(strike, _1, _2, s.ratio, s.speed, s.distance), {{"passes", 0, s.most}});
  return all;
}

}  // namespace sap_test::physics
