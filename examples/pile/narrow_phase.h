#ifndef PILE_NARROW_PHASE_H
#define PILE_NARROW_PHASE_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include <vector>

namespace pile {

struct Pair {
  dGeomID first;
  dGeomID second;
};

// Turns pairs of geoms into contacts with ODE's colliders. A pair that no awake body is part of is
// passed over: nothing about it can change. Of too many contacts, dParallelSAPKeepSpread keeps
// some.
class NarrowPhase {
 public:
  explicit NarrowPhase(int contacts_per_pair);

  // Replaces `contacts` by those of the pairs, in their order, one pair after the other.
  void run(const std::vector<Pair>& pairs, std::vector<dContactGeom>& contacts);
  // The same for all pairs of a parallel space, which it finds and collides on its threads.
  void run(dSpaceID space, std::vector<dContactGeom>& contacts);

 private:
  static int flagsOf(void* phase, dGeomID first, dGeomID second);
  static int reduce(void* phase, dGeomID first, dGeomID second, dContactGeom* contacts, int count);
  static void append(void* phase, dGeomID first, dGeomID second, const dContactGeom* contacts,
                     int count);

  int most_;
  std::vector<dContactGeom> found_;
  std::vector<dContactGeom>* contacts_ = nullptr;  // during run()
};

}  // namespace pile

#endif
