#ifndef PILE_MOTION_H
#define PILE_MOTION_H

#include <string>

#include "world.h"

namespace pile {

// The state of all bodies at one moment.
struct Motion {
  size_t bodies = 0;
  size_t asleep = 0;
  size_t fallen = 0;      // centres below the ground
  size_t not_finite = 0;  // left out of what follows
  double energy = 0;   // kinetic and potential, the latter over height 0; kg metres^2 / seconds^2
  double fastest = 0;  // metres a second
  double lowest = 0;   // height of the lowest centre
  double highest = 0;
};

Motion measure(const World& world);

// Follows a run and says at its end whether the pile behaved.
class MotionLog {
 public:
  explicit MotionLog(const Motion& start)
      : start_(start), last_(start), most_energy_(start.energy) {}

  void add(const Motion& motion, double deepest);

  // Energy was put in from outside, by as much as this motion has more than the last one.
  void allow(const Motion& motion);

  const Motion& start() const { return start_; }
  const Motion& last() const { return last_; }
  double fastestEver() const { return fastest_; }
  double deepestEver() const { return deepest_; }
  double deepestNow() const { return deepest_now_; }

  // What is wrong, in words; empty if nothing is: all bodies are finite and above the ground, and
  // at no time was there more energy than at the start.
  std::string fault() const;

 private:
  Motion start_;
  Motion last_;
  double most_energy_;
  double fastest_ = 0;
  double deepest_ = 0;
  double deepest_now_ = 0;
};

}  // namespace pile

#endif
