#ifndef PILE_OPTIONS_H
#define PILE_OPTIONS_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include <map>
#include <optional>
#include <stdexcept>
#include <string>

namespace pile {

enum class SpaceKind { Parallel, Hash, SweepAndPrune, Simple };

// The words of the command line for methods and back ends.
using Names = std::map<std::string, int>;
extern const Names method_names, backend_names;

// What the command line said, with the scene's own values where it said nothing.
struct Options {
  std::string scene = "cubes";
  int bodies = 0;
  int steps = 0;
  int settle = 0;  // steps before those that are measured
  unsigned seed = 1;
  SpaceKind space = SpaceKind::Parallel;
  std::optional<int> threads;  // these four are for the parallel space only
  std::optional<int> method;
  std::optional<int> backend;
  bool parallel_narrow = true;
  bool check = false;
  int compare = 0;           // steps more in dHashSpace, and as many in the parallel space
  std::string csv;           // empty: none
  bool view = false;         // then `steps` is the largest int unless it was given
  std::string snapshot;      // empty: none
  bool if_possible = false;  // without means to draw the run has no picture, and says why
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
