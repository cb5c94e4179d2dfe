// What is measured of a scene while it runs, and what is said of it: the outcome is one of few
// words, by limits that are the same for all scenes of a demand.
#pragma once

#include <string>
#include <vector>

#include "extreme.h"

namespace sap_test {
namespace physics {

// Lengths in units of the scene. "Late" is the last fifth of the steps.
struct Measures {
  double sink = 0;      // the furthest that a body is below its place at the start
  double shift = 0;     // the furthest that a body is from its place at the start
  double creep = 0;     // the furthest that a body went in the second half
  double depth = 0;     // the deepest contact, late
  double speed = 0;     // the fastest body, late; in units a second
  double gain = 0;      // the most energy that came from nowhere, as a part of what was there
  double lost = 0;      // bodies where nothing lets them come to
  double gap = 0;       // the widest gap of a joint, or what else is wrong with it, late
  double energy = 0;    // of a free body: relative change
  double momentum = 0;  // the same of its angular momentum
  double turn = 0;      // radians by which it is turned otherwise than it should be
};

class Observer {
 public:
  // The scene as it is built.
  Observer(const Extreme& extreme, const Stage& stage);
  // After the step of this number.
  void look(Stage& stage, int step);
  // After the last one.
  const Measures& end(const Stage& stage);

 private:
  struct Body {
    Vec start, middle;
    dReal rotation[12];
  };
  double energyOf(const Stage& stage) const;
  void lookLate(const Stage& stage);
  void compareFree(const Stage& stage);

  const Extreme& extreme_;
  std::vector<Body> bodies_;
  double energy_ = 0, energy_scale_ = 0;
  Vec momentum_;
  Vec spin_;
  double time_ = 0;
  double cell_coherence_ = 0;  // of the turn, radians
  Measures measures_;
};

// The outcome in a word.
std::string judge(const Extreme& extreme, const Measures& measures);
// Whether that is what the scene owes.
bool isWhatItOwes(const std::string& outcome);

}  // namespace physics
}  // namespace sap_test
