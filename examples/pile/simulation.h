#ifndef PILE_SIMULATION_H
#define PILE_SIMULATION_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include <optional>
#include <string>
#include <vector>

#include "check.h"
#include "narrow_phase.h"
#include "options.h"
#include "world.h"

namespace pile {

// What one time step did. Times are wall-clock milliseconds.
struct Frame {
  int number = 0;  // from 1
  size_t pairs = 0;
  size_t contacts = 0;
  double broad_ms = 0;
  double narrow_ms = 0;
  double joints_ms = 0;
  double solver_ms = 0;
  int broad_threads = 1;
  int narrow_threads = 1;
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

  // What --check found wrong in the last step; empty if nothing or not asked.
  const std::optional<std::string>& difference() const { return difference_; }
  const std::vector<dContactGeom>& contacts() const { return contacts_; }

 private:
  void collide(Frame& frame);
  void queuePairs();
  void findContacts(Frame& frame);
  void createJoints();

  World& world_;
  const double dt_;
  int steps_done_ = 0;
  dJointGroupID joints_;
  const bool parallel_narrow_;
  NarrowPhase narrow_phase_;
  std::optional<PairCheck> check_;
  std::optional<std::string> difference_;
  std::vector<Pair> pairs_;
  std::vector<dContactGeom> contacts_;
};

}  // namespace pile

#endif
