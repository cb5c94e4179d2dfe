#ifndef TRADEOFF_BALANCE_H
#define TRADEOFF_BALANCE_H

#include <ode/ode.h>

#include <array>
#include <deque>
#include <vector>

namespace tradeoff {

using Vector = std::array<double, 3>;

// Keeps the books of all bodies' momentum: in a step it may change only by gravity and by what the
// static geoms push, as the solver reports it. What is left over came from nowhere: rounding, and
// for angular momentum also how the solver turns bodies.
class Balance {
 public:
  Balance(dWorldID world, const std::vector<dBodyID>& bodies);

  // To be called for each contact joint before the solver runs.
  void watch(dJointID joint);

  // To be called after each step.
  void close(double dt);

  // Over all steps, as shares of what gravity alone brought in (for angular momentum: at the
  // distance of the bodies from the origin, in the quadratic mean).
  double linearDrift() const;
  double angularDrift() const;

 private:
  struct Support {
    dBodyID body;
    dJointFeedback force;
  };
  struct Momentum {
    Vector linear;
    Vector angular;  // about the origin
  };

  Momentum measure() const;

  const std::vector<dBodyID>& bodies_;
  std::deque<Support> supports_;  // of this step; the joints point into it
  std::vector<Vector> places_;    // of the bodies before the step
  Vector gravity_;
  double mass_ = 0;
  Momentum last_;
  Momentum left_over_ = {};
  double time_ = 0;
  double distance_ = 0;
};

}  // namespace tradeoff

#endif
