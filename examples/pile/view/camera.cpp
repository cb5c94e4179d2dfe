#include "camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pile {
namespace {

using Vector = std::array<double, 3>;

constexpr double degree = 3.14159265358979 / 180;
constexpr double heading = 125;
constexpr double pitch = -27;
constexpr double margin = 0.04;     // of the picture's half width and height
constexpr double stray = 2.5;       // times the root mean square distance from the middle
constexpr double legible = 0.01;    // a body's share of the picture's width, in the middle
constexpr double clearance = 0.25;  // between camera and bodies, of the way to the middle

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The camera's axes in the world.
const Vector ahead = {std::cos(heading * degree) * std::cos(pitch * degree),
                      std::sin(heading* degree) * std::cos(pitch* degree), std::sin(pitch* degree)};
const Vector right = {std::sin(heading * degree), -std::cos(heading* degree), 0};
const Vector up = {-std::cos(heading * degree) * std::sin(pitch * degree),
                   -std::sin(heading* degree) * std::sin(pitch* degree), std::cos(pitch* degree)};

Vector middleOf(const std::vector<Vector>& places) {
  Vector middle = {0, 0, 0};
  for (const Vector& place : places)
    for (size_t i = 0; i < 3; ++i) middle[i] += place[i] / static_cast<double>(places.size());
  return middle;
}

double distance(const Vector& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Of the bodies, without those that are nowhere or far away from all others.
std::vector<Vector> placesToShow(const World& world) {
  std::vector<Vector> places;
  for (dBodyID body : world.bodies()) {
    const dReal* p = dBodyGetPosition(body);
    if (std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]))
      places.push_back({p[0], p[1], p[2]});
  }
  const Vector middle = middleOf(places);
  double square = 0;
  for (const Vector& place : places)
    square += std::pow(distance(place, middle), 2) / static_cast<double>(places.size());
  // A hair more, so that rounding leaves out no body of one or two.
  const double far = 1e-9 + stray * std::sqrt(square);
  places.erase(std::remove_if(places.begin(), places.end(),
                              [&](const Vector& p) { return distance(p, middle) > far; }),
               places.end());
  if (places.empty()) places.push_back({0, 0, 0});
  return places;
}

// A ball to be in the picture, seen along one side of it.
struct Ball {
  double across, depth, radius;
};

// Where on such a side, and how deep, the camera must stand.
struct Stand {
  double across, depth;
};

// The nearest place that has all balls within an opening.
Stand standFor(const std::vector<Ball>& balls, double opening) {
  double low = -std::numeric_limits<double>::infinity();
  double high = low;
  for (const Ball& ball : balls) {
    const double reach = ball.radius * std::hypot(1, opening) - opening * ball.depth;
    low = std::max(low, reach - ball.across);
    high = std::max(high, reach + ball.across);
  }
  return {(high - low) / 2, -(high + low) / (2 * opening)};
}

// Where to stand at this depth or farther back, with as much room on both sides.
Stand centredFor(const std::vector<Ball>& balls, double opening, double depth) {
  double narrow = 0;
  constexpr int halvings = 50;
  for (int i = 0; i < halvings; ++i) {
    const double middle = (narrow + opening) / 2;
    (standFor(balls, middle).depth < depth ? narrow : opening) = middle;
  }
  return standFor(balls, opening);
}

// Where to stand to see everything.
Vector placeToSeeAll(const World& world, const std::vector<Vector>& bodies) {
  std::vector<Ball> sideways, upwards;
  const auto add = [&](const Vector& place, double radius) {
    sideways.push_back({dot(place, right), dot(place, ahead), radius});
    upwards.push_back({dot(place, up), dot(place, ahead), radius});
  };
  for (const Vector& body : bodies) {
    add(body, world.body_size / 2);
    add({body[0], body[1], world.ground_height(body[0], body[1])}, 0);
  }
  if (world.ground_holds_bodies)
    for (dGeomID geom : world.geoms())
      if (!dGeomGetBody(geom))
        for (const Mesh::Point& point : world.meshOf(geom).points)
          add({point[0], point[1], point[2]}, 0);
  constexpr double wide = (1 - margin) * camera_opening;
  constexpr double tall = (1 - margin) * camera_opening_up;
  const double depth = std::min(standFor(sideways, wide).depth, standFor(upwards, tall).depth);
  const double x = centredFor(sideways, wide, depth).across;
  const double y = centredFor(upwards, tall, depth).across;
  Vector place;
  for (size_t i = 0; i < 3; ++i) place[i] = x * right[i] + y * up[i] + depth * ahead[i];
  return place;
}

// How far a body may be away: the side of a cube of a body's mean volume is wide enough then.
double legibleDistance(const World& world) {
  double volume = 0;
  for (dBodyID body : world.bodies()) {
    dMass mass;
    dBodyGetMass(body, &mass);
    volume += mass.mass / static_cast<double>(world.bodies().size());  // the density is 1
  }
  return std::cbrt(volume) / legible / (2 * camera_opening);
}

Vector between(const Vector& from, const Vector& to, double share) {
  Vector place;
  for (size_t i = 0; i < 3; ++i) place[i] = from[i] + share * (to[i] - from[i]);
  return place;
}

}  // namespace

Camera cameraFor(const World& world) {
  const std::vector<Vector> bodies = placesToShow(world);
  const Vector middle = middleOf(bodies);
  const Vector back = placeToSeeAll(world, bodies);
  Camera camera = {back, heading, pitch};
  if (world.ground_holds_bodies) return camera;
  const auto isClear = [&](const Vector& place) {
    const double least = clearance * distance(place, middle);
    return std::all_of(bodies.begin(), bodies.end(),
                       [&](const Vector& body) { return distance(place, body) >= least; });
  };
  constexpr double step = 1.1;
  for (double share = legibleDistance(world) / distance(back, middle); share < 1; share *= step) {
    camera.position = between(middle, back, share);
    if (isClear(camera.position)) return camera;
  }
  camera.position = back;
  return camera;
}

}  // namespace pile
