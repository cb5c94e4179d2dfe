#ifndef PILE_OPTIONS_H
#define PILE_OPTIONS_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace pile {

enum class SpaceKind { Parallel, Hash, SweepAndPrune, QuadTree, Simple };

// Which contacts are kept of a pair that has more than it may have.
enum class Reducer { Farthest, Deepest, Spread };

// What the parallel space may leave out or add.
struct Rules {
  double tolerance = 0;  // metres
  bool skip_static = false;
  bool skip_asleep = false;
  bool cull_planes = false;

  bool any() const { return tolerance > 0 || skip_static || skip_asleep || cull_planes; }
};

// What the command line said, with the scene's own values where it said nothing.
struct Options {
  std::string scene = "cubes";
  int bodies = 0;
  int steps = 0;
  double dt = 0;       // seconds
  int iterations = 0;  // of QuickStep
  int contacts = 0;    // at most this many a pair
  std::uint64_t seed = 1;
  double erp = 0.2;              // the part of an error of a joint that one step mends
  double cfm = 1e-5;             // how far constraints give, s/kg
  double density = 1;            // kg/m^3
  int settle = 0;                // steps before those that are measured
  bool random_bodies = false;    // created in random order, not in that of their places
  bool random_contacts = false;  // joints in random order, not in that of the pairs
  Reducer reducer = Reducer::Farthest;
  bool sleep = true;  // bodies at rest are disabled
  SpaceKind space = SpaceKind::Parallel;
  std::optional<int> threads;  // these three are for the parallel space only
  std::optional<int> method;
  std::optional<int> backend;
  Rules rules;                     // for the parallel space only
  bool parallel_narrow = false;    // for the parallel space only
  bool parallel_stepping = false;  // by ODE's own threads
  bool check = false;
  int compare = 0;                    // steps more in dHashSpace, and as many in the parallel space
  std::string csv;                    // empty: none
  bool view = false;                  // then `steps` is the largest int unless it was given
  std::string snapshot;               // empty: none
  std::string times_picture;          // empty: none
  bool snapshot_if_possible = false;  // without means to draw it is left out, and the run says why
  std::vector<std::string> drawing;   // drawstuff's own flags
};

// Something the user asked for that cannot be done: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Reads the command line. Empty if it was a request for help, which has been printed then; throws
// UsageError if it is wrong.
std::optional<Options> parseOptions(int argc, char** argv);

}  // namespace pile

#endif
