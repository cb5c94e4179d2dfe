#include "balance.h"

#include <cmath>
#include <cstdint>

namespace tradeoff {
namespace {

Vector vectorOf(const dReal* values) {
  return {static_cast<double>(values[0]), static_cast<double>(values[1]),
          static_cast<double>(values[2])};
}

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

void addScaled(Vector& sum, double scale, const Vector& term) {
  for (size_t i = 0; i < 3; ++i) sum[i] += scale * term[i];
}

double length(const Vector& v) {
  return std::hypot(v[0], v[1], v[2]);
}

double massOf(dBodyID body) {
  dMass mass;
  dBodyGetMass(body, &mass);
  return mass.mass;
}

// Angular momentum about the body's own centre.
Vector spinOf(dBodyID body) {
  dMass mass;
  dBodyGetMass(body, &mass);
  const Vector rate = vectorOf(dBodyGetAngularVel(body));
  const dReal* r = dBodyGetRotation(body);
  Vector local = {0, 0, 0};
  Vector spin = {0, 0, 0};
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) local[i] += r[4 * j + i] * rate[j];
  Vector turned = {0, 0, 0};
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) turned[i] += mass.I[4 * i + j] * local[j];
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) spin[i] += r[4 * i + j] * turned[j];
  return spin;
}

}  // namespace

Balance::Balance(dWorldID world, const std::vector<dBodyID>& bodies) : bodies_(bodies) {
  dVector3 gravity;
  dWorldGetGravity(world, gravity);
  gravity_ = vectorOf(gravity);
  double square = 0;
  for (dBodyID body : bodies_) {
    mass_ += massOf(body);
    square += std::pow(length(vectorOf(dBodyGetPosition(body))), 2);
    places_.push_back(vectorOf(dBodyGetPosition(body)));
  }
  distance_ = std::sqrt(square / static_cast<double>(bodies_.size()));
  last_ = measure();
}

void Balance::watch(dJointID joint) {
  if (dJointGetBody(joint, 0) && dJointGetBody(joint, 1)) return;
  const dBodyID body = dJointGetBody(joint, 0) ? dJointGetBody(joint, 0) : dJointGetBody(joint, 1);
  supports_.push_back({body, {}});
  dJointSetFeedback(joint, &supports_.back().force);
}

Balance::Momentum Balance::measure() const {
  Momentum momentum = {};
  for (dBodyID body : bodies_) {
    Vector linear = {0, 0, 0};
    addScaled(linear, massOf(body), vectorOf(dBodyGetLinearVel(body)));
    addScaled(momentum.linear, 1, linear);
    addScaled(momentum.angular, 1, cross(vectorOf(dBodyGetPosition(body)), linear));
    addScaled(momentum.angular, 1, spinOf(body));
  }
  return momentum;
}

void Balance::close(double dt) {
  Momentum expected = last_;
  const auto push = [&](const Vector& place, double scale, const Vector& force) {
    addScaled(expected.linear, scale, force);
    addScaled(expected.angular, scale, cross(place, force));
  };
  for (size_t i = 0; i < bodies_.size(); ++i) push(places_[i], dt * massOf(bodies_[i]), gravity_);
  for (const Support& support : supports_) {
    // The solver's forces act at the places before the step. It gives the only body as the first.
    const auto body =
        static_cast<size_t>(reinterpret_cast<std::uintptr_t>(dBodyGetData(support.body)));
    push(places_[body], dt, vectorOf(support.force.f1));
    addScaled(expected.angular, dt, vectorOf(support.force.t1));
  }
  last_ = measure();
  for (size_t i = 0; i < 3; ++i) {
    left_over_.linear[i] += last_.linear[i] - expected.linear[i];
    left_over_.angular[i] += last_.angular[i] - expected.angular[i];
  }
  time_ += dt;
  supports_.clear();
  for (size_t i = 0; i < bodies_.size(); ++i) places_[i] = vectorOf(dBodyGetPosition(bodies_[i]));
}

double Balance::linearDrift() const {
  return length(left_over_.linear) / (mass_ * length(gravity_) * time_);
}

double Balance::angularDrift() const {
  return length(left_over_.angular) / (mass_ * length(gravity_) * time_ * distance_);
}

}  // namespace tradeoff
