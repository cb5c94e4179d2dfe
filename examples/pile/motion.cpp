#include "motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pile {
namespace {

// A pile that settles only loses energy. Pushing bodies out of each other adds some, far less than
// the fall brings; a pile that explodes gains many times its own.
constexpr double allowed_gain = 0.02;

double kineticEnergy(dBodyID body, const dMass& mass) {
  const dReal* v = dBodyGetLinearVel(body);
  const dReal* w = dBodyGetAngularVel(body);
  dVector3 local;  // the angular velocity in the body's frame, where the inertia is constant
  dBodyVectorFromWorld(body, w[0], w[1], w[2], local);
  double energy = 0;
  for (int i = 0; i < 3; ++i) {
    energy += 0.5 * mass.mass * v[i] * v[i];
    for (int j = 0; j < 3; ++j) energy += 0.5 * local[i] * mass.I[4 * i + j] * local[j];
  }
  return energy;
}

bool isFinite(dBodyID body) {
  const dReal* parts[] = {dBodyGetPosition(body), dBodyGetLinearVel(body),
                          dBodyGetAngularVel(body)};
  for (const dReal* part : parts)
    for (int i = 0; i < 3; ++i)
      if (!std::isfinite(part[i])) return false;
  return true;
}

}  // namespace

Motion measure(const World& world) {
  Motion motion;
  motion.bodies = world.bodies().size();
  motion.lowest = std::numeric_limits<double>::infinity();
  motion.highest = -motion.lowest;
  dVector3 gravity;
  dWorldGetGravity(world.ode(), gravity);
  for (dBodyID body : world.bodies()) {
    if (!isFinite(body)) {
      ++motion.not_finite;
      continue;
    }
    dMass mass;
    dBodyGetMass(body, &mass);
    const dReal* p = dBodyGetPosition(body);
    const dReal* v = dBodyGetLinearVel(body);
    if (!dBodyIsEnabled(body)) ++motion.asleep;
    if (p[2] < world.ground_height(p[0], p[1])) ++motion.fallen;
    motion.energy += kineticEnergy(body, mass) - mass.mass * gravity[2] * p[2];
    motion.fastest = std::max(
        motion.fastest, static_cast<double>(std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])));
    motion.lowest = std::min(motion.lowest, static_cast<double>(p[2]));
    motion.highest = std::max(motion.highest, static_cast<double>(p[2]));
  }
  return motion;
}

void MotionLog::add(const Motion& motion, double deepest) {
  last_ = motion;
  most_energy_ = std::max(most_energy_, motion.energy);
  fastest_ = std::max(fastest_, motion.fastest);
  deepest_ = std::max(deepest_, deepest);
  deepest_now_ = deepest;
}

void MotionLog::allow(const Motion& motion) {
  const double added = motion.energy - last_.energy;
  start_.energy += added;
  most_energy_ += added;
  last_ = motion;
}

std::string MotionLog::fault() const {
  if (last_.not_finite)
    return std::to_string(last_.not_finite) + " bodies have a position or speed that is no number";
  if (last_.fallen)
    return std::to_string(last_.fallen) + " bodies fell through the ground or over its edge";
  const double gain = most_energy_ / start_.energy - 1;
  if (gain > allowed_gain)
    return "the energy rose to " + std::to_string(std::lround(100 * (1 + gain))) +
           " % of what it was: the pile exploded";
  return "";
}

}  // namespace pile
