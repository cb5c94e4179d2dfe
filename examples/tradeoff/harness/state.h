#ifndef TRADEOFF_HARNESS_STATE_H
#define TRADEOFF_HARNESS_STATE_H

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

#include "vectors.h"

namespace tradeoff {

// What is fixed of a scene once it is built.
struct Basis {
  std::vector<dBodyID> bodies;  // those with a geom that forces move, in the order of the space
  std::vector<dGeomID> planes;  // without a body
  Vector up = {0, 0, 1};        // against gravity
  double gravity = 0;           // m/s^2
  double mass = 0;
  double size = 1;        // mean longest extent of the bodies' geoms, at the start
  double speed = 1;       // of a fall through half a size, m/s; 1 without gravity
  dBodyID top = nullptr;  // the highest body at the start
};

namespace state {

inline void collect(dSpaceID space, Basis& basis, std::set<dBodyID>& seen, double& extents) {
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) {
    const dGeomID geom = dSpaceGetGeom(space, i);
    if (dGeomIsSpace(geom)) {
      collect(reinterpret_cast<dSpaceID>(geom), basis, seen, extents);
      continue;
    }
    const dBodyID body = dGeomGetBody(geom);
    if (!body && dGeomGetClass(geom) == dPlaneClass) basis.planes.push_back(geom);
    if (!body || dBodyIsKinematic(body) || !seen.insert(body).second) continue;
    dReal box[6];
    dGeomGetAABB(geom, box);
    extents += static_cast<double>(std::max({box[1] - box[0], box[3] - box[2], box[5] - box[4]}));
    basis.bodies.push_back(body);
  }
}

}  // namespace state

inline Basis basisOf(dWorldID world, dSpaceID space) {
  Basis basis;
  std::set<dBodyID> seen;
  double extents = 0;
  state::collect(space, basis, seen, extents);
  const Vector gravity = gravityOf(world);
  basis.gravity = length(gravity);
  if (basis.gravity > 0)
    for (size_t i = 0; i < 3; ++i) basis.up[i] = -gravity[i] / basis.gravity;
  if (basis.bodies.empty()) return basis;
  basis.size = extents / static_cast<double>(basis.bodies.size());
  basis.speed = basis.gravity > 0 ? std::sqrt(basis.gravity * basis.size) : 1;
  double highest = -std::numeric_limits<double>::infinity();
  for (dBodyID body : basis.bodies) {
    basis.mass += massOf(body);
    const double height = dot(basis.up, vectorOf(dBodyGetPosition(body)));
    if (height > highest) basis.top = body;
    highest = std::max(highest, height);
  }
  return basis;
}

// All bodies at one moment; those without a finite place are only counted.
struct State {
  double energy = 0;  // kinetic and potential
  double height = 0;  // mean of the centres
  double highest = -std::numeric_limits<double>::infinity();
  double lowest = std::numeric_limits<double>::infinity();
  double square_speed = 0;  // mean, of rotation as of a body's ends
  double fastest = 0;
  size_t not_finite = 0;
  size_t asleep = 0;
};

inline State stateOf(const Basis& basis) {
  State now;
  double count = 0;
  for (dBodyID body : basis.bodies) {
    const Vector place = vectorOf(dBodyGetPosition(body));
    const Vector velocity = vectorOf(dBodyGetLinearVel(body));
    const Vector rate = vectorOf(dBodyGetAngularVel(body));
    const double height = dot(basis.up, place);
    const double square = dot(velocity, velocity) + dot(rate, rate) * basis.size * basis.size / 4;
    if (!std::isfinite(dot(place, place) + square)) {
      ++now.not_finite;
      continue;
    }
    now.energy += massOf(body) * (dot(velocity, velocity) / 2 + basis.gravity * height) +
                  dot(rate, spinOf(body)) / 2;
    now.height += height;
    now.highest = std::max(now.highest, height);
    now.lowest = std::min(now.lowest, height);
    now.square_speed += square;
    now.fastest = std::max(now.fastest, std::sqrt(square));
    now.asleep += !dBodyIsEnabled(body);
    ++count;
  }
  now.height /= std::max(count, 1.0);
  now.square_speed /= std::max(count, 1.0);
  return now;
}

// Whether the heap is at rest: nothing went further than this part of its usual speed while it was
// looked away for a moment. Speeds themselves would not do: jitter is fast and goes nowhere.
class Rest {
 public:
  static constexpr double look_every = 0.5;  // simulated seconds
  static constexpr double slow = 0.005;      // of Basis::speed

  explicit Rest(const Basis& basis) : basis_(basis) { remember(); }

  // To be called after each step; true once nothing moved between two looks.
  bool look(double time) {
    if (time - looked_ < look_every) return false;
    double furthest = 0;
    for (size_t i = 0; i < basis_.bodies.size(); ++i)
      furthest = std::max(furthest,
                          length(minus(vectorOf(dBodyGetPosition(basis_.bodies[i])), places_[i])));
    const bool still = furthest <= slow * basis_.speed * (time - looked_);
    looked_ = time;
    remember();
    return still;
  }

 private:
  void remember() {
    places_.clear();
    for (dBodyID body : basis_.bodies) places_.push_back(vectorOf(dBodyGetPosition(body)));
  }

  const Basis& basis_;
  std::vector<Vector> places_;
  double looked_ = 0;
};

}  // namespace tradeoff

#endif
