// Scenes at an extreme of physics, what should become of each, and the cheapest way to get there.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "../support/floating_point.h"
#include "stage.h"

namespace sap_test::physics {

// What a scene owes, by which its outcome is judged (outcome.h).
enum class Demand {
  stand,    // is at rest as it is built, and stays so
  stop,     // something fast does not get through something thin
  settle,   // comes to rest, whatever was wrong at the start
  hold,     // joints stay together, motors and stops do what they are set to
  conserve  // energy, angular momentum and the turn of a free body
};

// For names: 0.001 and 1e+06.
std::string shortNumber(double number);

struct Extreme {
  const char* theme;
  std::string name;
  Demand demand;
  std::function<void(Stage&)> build;
  double unit = 1;  // metres: what drift, depth and speed are measured by
  int steps = 300;
  // Whether a body is where nothing lets it come to.
  std::function<bool(const Stage&, std::size_t body)> lost = [](const Stage&, std::size_t) {
    return false;
  };
  double step = 0.01;
  // For Demand::hold: what is wrong, 1 being all of it. As it is, the widest gap of a joint.
  std::function<double(const Stage&)> error = nullptr;
  // Called before each step.
  std::function<void(Stage&, int step)> drive = [](Stage&, int) {};
  unsigned mode = FloatingPointMode::kDefault;
};

using Extremes = std::vector<Extreme>;

// All of them, by theme.
const Extremes& extremes();

Extremes masses();
Extremes structures();
Extremes speeds();
Extremes steps();
Extremes sizes();
Extremes places();
Extremes overlaps();
Extremes shapes();
Extremes joints();
Extremes spins();
Extremes longRuns();
Extremes modes();
// Not among all: what these need to hold has a table of its own.
Extremes machines();

// Extreme::lost where the floor is at z = 0.
bool isBelowFloor(const Stage& stage, std::size_t body);

// `count` boxes one on the other.
void stack(Stage& stage, int count, double side, const Vec& foot = {}, double density = 1000);
// Extreme::build: the same on a plane.
std::function<void(Stage&)> stackOnPlane(int count, double side = 1);

// What is measured of a scene while it runs. Lengths in units of the scene. "Late" is the last
// fifth of the steps.
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
  };
  void lookLate(const Stage& stage);
  void compareFree(const Stage& stage);

  const Extreme& extreme_;
  std::vector<Body> bodies_;
  double energy_ = 0, energy_scale_ = 0;
  Vec momentum_ = {0, 0, 0};
  Vec spin_ = {0, 0, 0};
  double time_ = 0;
  double turned_ = 0;  // of the turn, radians
  Measures measures_;
};

// The outcome in a word.
std::string judge(const Extreme& extreme, const Measures& measures);
// Whether that is what the scene owes.
bool isWhatItOwes(const std::string& outcome);

// A run in a process of its own: some end in an assertion of ODE's, a crash or no end.
struct Result {
  std::string outcome;  // judge()'s, "not finite", "aborts" or "crashes"
  Measures measures;
  std::uint64_t digest = 0;  // of every bit of every state of every body
  int steps = 0;             // that were made
  double microseconds = 0;   // of the processor, a step
};

// The part of its steps that is made is `length`.
Result play(const Extreme& extreme, Pairing pairing, const Setting& setting, double length = 1);

// Whether two runs are the same, bit for bit, as far as they went.
bool same(const Result& a, const Result& b);

// One start may be luck.
constexpr int kStarts = 10;

// In how many of so many starts the scene does what it owes.
int startsHeld(const Extreme& extreme, const Setting& setting);

}  // namespace sap_test::physics
