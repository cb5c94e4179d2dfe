#ifndef PILE_NARROW_PHASE_H
#define PILE_NARROW_PHASE_H

#include <ode/ode.h>

#include <vector>

namespace pile {

struct Pair {
  dGeomID first;
  dGeomID second;
};

// Turns pairs of geoms into contacts with ODE's colliders.
class NarrowPhase {
 public:
  explicit NarrowPhase(int contacts_per_pair);

  // Replaces `contacts` by those of the pairs, in their order. A pair that no awake body is part of
  // is passed over: nothing about it can change.
  void run(const std::vector<Pair>& pairs, std::vector<dContactGeom>& contacts);

 private:
  size_t most_;
  std::vector<dContactGeom> found_;
};

// Keeps the `most` contacts that say most about the rest: the deepest, then again and again the one
// farthest from those kept (in place and in direction of the normal). Reorders the list.
void reduceContacts(std::vector<dContactGeom>& contacts, size_t count, size_t most);

}  // namespace pile

#endif
