#ifndef PILE_SIMULATION_H
#define PILE_SIMULATION_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "check.h"
#include "narrow_phase.h"
#include "options.h"
#include "random.h"
#include "stepping.h"
#include "world.h"

namespace pile {

// How many threads each part of a step had.
struct PartThreads {
  int broad = 1;
  int narrow = 1;
  int joints = 1;
  int solver = 1;
};

// What one time step did. Times are wall-clock milliseconds.
struct Frame {
  int number = 0;   // from 1
  double time = 0;  // simulated seconds at its end
  size_t geoms = 0;
  size_t pairs = 0;
  size_t contacts = 0;
  double deepest = 0;  // penetration, metres
  double broad_ms = 0;
  double narrow_ms = 0;
  double joints_ms = 0;
  double solver_ms = 0;
  PartThreads threads;
  std::optional<dParallelSAPStats> stages;  // of the broad phase, if the space is ours

  double totalMs() const { return broad_ms + narrow_ms + joints_ms + solver_ms; }
};

// Steps a world: geoms -> pairs -> contacts -> joints -> motion.
class Simulation {
 public:
  // The world must be in a space already.
  Simulation(World& world, const Options& options);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  Frame step();

  // Calls this for each contact joint of the steps to come, before the solver runs.
  void watchJoints(std::function<void(dJointID)> watch) { watch_ = std::move(watch); }

  // What --check found wrong in the last step; empty if nothing or not asked.
  const std::optional<std::string>& difference() const { return difference_; }
  const std::vector<Pair>& pairs() const { return pairs_; }
  const std::vector<dContactGeom>& contacts() const { return contacts_; }

 private:
  void collide(Frame& frame);
  void queuePairs();
  void findContacts(Frame& frame);
  void createJoints();
  void shuffleContacts();

  World& world_;
  const double dt_;
  int steps_done_ = 0;
  dJointGroupID joints_;
  const bool parallel_narrow_;
  NarrowPhase narrow_phase_;
  std::function<void(dJointID)> watch_;
  const int solver_threads_;
  std::optional<ParallelStepping> stepping_;
  std::optional<Random> contact_order_;  // none: that of the pairs
  std::optional<PairCheck> check_;
  std::optional<std::string> difference_;
  std::vector<Pair> pairs_;
  std::vector<dContactGeom> contacts_;
};

}  // namespace pile

#endif
