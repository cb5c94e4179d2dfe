// Scenes at an extreme of physics, and what becomes of each; and scenes of which the answer is
// known.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "stage.h"

namespace sap_test::physics {

// What a scene owes, by which its outcome is judged (play.cpp).
enum class Demand {
  stand,  // is at rest as it is built, and stays so
  stop,   // something fast does not get through something thin
  hold    // joints stay together, motors and stops do what they are set to
};

struct Extreme {
  const char* theme;
  std::string name;
  Demand demand;
  Things things;
  double unit = 1;  // metres: what drift, depth and speed are measured by
  int steps = 300;
  double step = 0.01;
  // What is no thing in a row: joints, meshes.
  std::function<void(Stage&)> build = nullptr;
  // For Demand::hold: what is wrong, 1 being all of it.
  std::function<double(const Stage&)> error = nullptr;
  // Called before each step.
  std::function<void(Stage&)> drive = nullptr;
  // Whether a body is where nothing lets it come to.
  std::function<bool(const Stage&, std::size_t body)> lost = nullptr;
  Vec gravity = {0, 0, -kGravity};
};
using Extremes = std::vector<Extreme>;

// All of them, by theme.
const Extremes& extremes();
// Not among all: what these need to hold has a table of its own.
Extremes machines();

// What is measured of a scene while it runs. Lengths in units of the scene. "Late" is the last
// fifth of the steps.
struct Measures {
  double sink = 0;   // the furthest that a body is below its place at the start
  double shift = 0;  // the furthest that a body is from its place at the start
  double creep = 0;  // the furthest that a body went in the second half
  double depth = 0;  // the deepest contact, late
  double speed = 0;  // the fastest body, late; in units a second
  double gain = 0;   // the most energy that came from nowhere, as a part of what was there
  double lost = 0;   // bodies where nothing lets them come to
  double gap = 0;    // Extreme::error, late
};

struct Result {
  std::string outcome = "not finite";  // in a word
  Measures measures;
  std::uint64_t digest = 0;  // of every bit of every state of every body
  int steps = 0;             // all whose outcome was finite
};

// The part of its steps that is made is `length`.
Result play(const Extreme& extreme, Pairing pairing, const Setting& setting, double length = 1);

// Whether two runs are the same, bit for bit, as far as they went.
bool same(const Result& a, const Result& b);
// One start may be luck. In how many of so many starts the scene does what it owes.
constexpr int kStarts = 10;
int startsHeld(const Extreme& extreme, const Setting& setting);

// What is measured at the end of a run. The error is the difference in parts of `scale`. Without a
// scale the value says whether something happened that must not, 0 or 1.
struct Quantity {
  const char* name;
  double value, exact, scale;
};
using Quantities = std::vector<Quantity>;

// What an error must be, its mean and the worst: with settings that are checked.
struct Bound {
  const char* quantity;
  double least, mean, most = 1e300;
};

struct Scene {
  std::string name;
  const char* of;  // what it is measured in
  std::function<Quantities(const Setting&, int run)> play;
  enum Kind { contact, free, slow, swept } kind;
  int runs;
  std::vector<Bound> bounds;
};

std::vector<Scene> truthScenes();
std::vector<Scene> sweptScenes();

// In each run another part of one: no step divides these.
inline double phaseOf(int run) {
  const double golden = 0.618033988749895 * run;
  return golden - std::floor(golden);
}

}  // namespace sap_test::physics
