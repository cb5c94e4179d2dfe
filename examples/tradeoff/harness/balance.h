#ifndef TRADEOFF_HARNESS_BALANCE_H
#define TRADEOFF_HARNESS_BALANCE_H

#include <algorithm>
#include <map>
#include <vector>

#include "vectors.h"

namespace tradeoff {

// Keeps the books of all bodies' momentum: in a step it may change only by gravity, by the forces
// that the program adds to bodies, and by what joints with the static world push, as the solver
// reports it. What is left over came from nowhere: rounding, damping, bodies put to sleep, and for
// angular momentum also how the solver turns bodies.
class Balance {
 public:
  Balance(dWorldID world, const std::vector<dBodyID>& bodies)
      : bodies_(bodies), gravity_(gravityOf(world)), origin_{0, 0, 0} {
    for (dBodyID body : bodies_) mass_ += massOf(body);
    for (dBodyID body : bodies_)
      addScaled(origin_, massOf(body) / mass_, vectorOf(dBodyGetPosition(body)));
    double square = 0;
    for (dBodyID body : bodies_) square += dot(place(body), place(body));
    distance_ = std::sqrt(square / static_cast<double>(bodies_.size()));
  }

  // After contacts and forces are there, before the solver runs.
  void open() {
    last_ = measure();
    pushes_.clear();
    for (dBodyID body : bodies_) {
      Push push{body, place(body), {0, 0, 0}, {0, 0, 0}, nullptr};
      push.force = vectorOf(dBodyGetForce(body));
      push.torque = vectorOf(dBodyGetTorque(body));
      if (dBodyGetGravityMode(body)) addScaled(push.force, massOf(body), gravity_);
      pushes_.push_back(push);
      for (int i = 0; i < dBodyGetNumJoints(body); ++i) watch(body, dBodyGetJoint(body, i));
    }
  }

  // After the solver ran.
  void close(double dt) {
    Momentum expected = last_;
    for (Push& push : pushes_) {
      if (push.feedback) {
        push.force = vectorOf(push.feedback->f1);
        push.torque = vectorOf(push.feedback->t1);
      }
      addScaled(expected.linear, dt, push.force);
      addScaled(expected.angular, dt, cross(push.place, push.force));
      addScaled(expected.angular, dt, push.torque);
    }
    const Momentum now = measure();
    addScaled(left_over_.linear, 1, minus(now.linear, expected.linear));
    addScaled(left_over_.angular, 1, minus(now.angular, expected.angular));
    time_ += dt;
  }

  // Over all steps, as shares of what gravity alone brought in (without gravity: of all mass at
  // 1 m/s); for angular momentum at the bodies' distance from their middle, in the quadratic mean.
  double linearDrift() const { return length(left_over_.linear) / scale(); }
  double angularDrift() const {
    return length(left_over_.angular) / (scale() * std::max(distance_, 1e-9));
  }

 private:
  struct Push {
    dBodyID body;
    Vector place;
    Vector force;
    Vector torque;
    const dJointFeedback* feedback;  // then these are the solver's
  };
  struct Momentum {
    Vector linear;
    Vector angular;  // about where the bodies' middle was at the start
  };

  Vector place(dBodyID body) const { return minus(vectorOf(dBodyGetPosition(body)), origin_); }

  double scale() const {
    return mass_ * (length(gravity_) > 0 ? length(gravity_) * std::max(time_, 1e-9) : 1);
  }

  // Of a joint with the static world the solver gives the only body's force as the first.
  void watch(dBodyID body, dJointID joint) {
    if (dJointGetBody(joint, 0) && dJointGetBody(joint, 1)) return;
    if (!dJointGetFeedback(joint)) dJointSetFeedback(joint, &feedbacks_[joint]);
    pushes_.push_back({body, place(body), {0, 0, 0}, {0, 0, 0}, dJointGetFeedback(joint)});
    // What the solver does not reach, as of bodies that sleep, pushes nothing.
    *dJointGetFeedback(joint) = dJointFeedback{};
  }

  Momentum measure() const {
    Momentum momentum = {};
    for (dBodyID body : bodies_) {
      Vector linear = {0, 0, 0};
      addScaled(linear, massOf(body), vectorOf(dBodyGetLinearVel(body)));
      addScaled(momentum.linear, 1, linear);
      addScaled(momentum.angular, 1, cross(place(body), linear));
      addScaled(momentum.angular, 1, spinOf(body));
    }
    return momentum;
  }

  const std::vector<dBodyID>& bodies_;
  std::map<dJointID, dJointFeedback> feedbacks_;  // a map's values stay where they are
  std::vector<Push> pushes_;                      // of this step
  Vector gravity_;
  Vector origin_;
  double mass_ = 0;
  Momentum last_ = {};
  Momentum left_over_ = {};
  double time_ = 0;
  double distance_ = 0;
};

}  // namespace tradeoff

#endif
