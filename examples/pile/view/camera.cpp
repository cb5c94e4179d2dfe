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
constexpr double margin = 0.04;   // of the picture's half width and height
constexpr double stray = 2.5;     // times the root mean square distance from the middle
constexpr double legible = 0.01;  // a body's share of the picture's width, in the middle
constexpr double clearance = 3;   // sizes of a body between it and the camera

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

using Boxes = std::vector<std::array<dReal, 6>>;

Vector middleOf(const std::array<dReal, 6>& box) {
  return {(box[0] + box[1]) / 2, (box[2] + box[3]) / 2, (box[4] + box[5]) / 2};
}

bool isSomewhere(const Vector& place) {
  return std::isfinite(place[0]) && std::isfinite(place[1]) && std::isfinite(place[2]);
}

// The bodies' AABBs, without those that are nowhere or far away from all others.
Boxes boxesToShow(const World& world) {
  Boxes boxes;
  std::vector<Vector> places;
  for (dGeomID geom : world.geoms()) {
    if (!dGeomGetBody(geom)) continue;
    dGeomGetAABB(geom, boxes.emplace_back().data());
    if (isSomewhere(middleOf(boxes.back())))
      places.push_back(middleOf(boxes.back()));
    else
      boxes.pop_back();
  }
  const Vector middle = middleOf(places);
  double square = 0;
  for (const Vector& place : places)
    square += std::pow(distance(place, middle), 2) / static_cast<double>(places.size());
  // A hair more, so that rounding leaves out no body of one or two.
  const double far = 1e-9 + stray * std::sqrt(square);
  boxes.erase(
      std::remove_if(boxes.begin(), boxes.end(),
                     [&](const auto& box) { return distance(middleOf(box), middle) > far; }),
      boxes.end());
  if (boxes.empty()) boxes.push_back({-1, 1, -1, 1, -1, 1});
  return boxes;
}

std::vector<Vector> middlesOf(const Boxes& boxes) {
  std::vector<Vector> middles;
  for (const auto& box : boxes) middles.push_back(middleOf(box));
  return middles;
}

// A point to be in the picture, seen along one side of it; or where on such a side, and how deep,
// the camera must stand.
struct Place {
  double across, depth;
};

// The nearest stand that has all points within an opening.
Place standFor(const std::vector<Place>& points, double opening) {
  double low = -std::numeric_limits<double>::infinity();
  double high = low;
  for (const Place& point : points) {
    low = std::max(low, -point.across - opening * point.depth);
    high = std::max(high, point.across - opening * point.depth);
  }
  return {(high - low) / 2, -(high + low) / (2 * opening)};
}

// Where across to stand at this depth, which is no nearer, with as much room on both sides.
double centredFor(const std::vector<Place>& points, double opening, double depth) {
  double narrow = 0;
  constexpr int halvings = 30;
  for (int i = 0; i < halvings; ++i) {
    const double middle = (narrow + opening) / 2;
    (standFor(points, middle).depth < depth ? narrow : opening) = middle;
  }
  return standFor(points, opening).across;
}

// Calls add for every point that is to be in the picture.
template <typename Add>
void forEachPoint(const World& world, const Boxes& boxes, const Add& add) {
  for (const auto& box : boxes) {
    for (unsigned corner = 0; corner < 8; ++corner)
      add({box[corner & 1], box[2 + (corner >> 1 & 1)], box[4 + (corner >> 2)]});
    const Vector middle = middleOf(box);
    add({middle[0], middle[1], world.ground_height(middle[0], middle[1])});
  }
  if (!world.ground_holds_bodies) return;
  for (dGeomID geom : world.geoms())
    if (!dGeomGetBody(geom))
      for (const Mesh::Point& point : world.meshOf(geom).points)
        add({point[0], point[1], point[2]});
}

// Where to stand to see everything.
Vector placeToSeeAll(const World& world, const Boxes& boxes) {
  std::vector<Place> sideways, upwards;
  forEachPoint(world, boxes, [&](const Vector& point) {
    sideways.push_back({dot(point, right), dot(point, ahead)});
    upwards.push_back({dot(point, up), dot(point, ahead)});
  });
  constexpr double wide = (1 - margin) * camera_opening;
  constexpr double tall = (1 - margin) * camera_opening_up;
  const double depth = std::min(standFor(sideways, wide).depth, standFor(upwards, tall).depth);
  const double x = centredFor(sideways, wide, depth);
  const double y = centredFor(upwards, tall, depth);
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
  const Boxes boxes = boxesToShow(world);
  const std::vector<Vector> bodies = middlesOf(boxes);
  const Vector middle = middleOf(bodies);
  const Vector back = placeToSeeAll(world, boxes);
  Camera camera = {back, heading, pitch};
  if (world.ground_holds_bodies) return camera;
  const auto isClear = [&](const Vector& place) {
    return std::all_of(bodies.begin(), bodies.end(), [&](const Vector& body) {
      return distance(place, body) >= clearance * world.body_size;
    });
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
