#ifndef PILE_CHECK_H
#define PILE_CHECK_H

#include <ode/ode.h>

#include <optional>
#include <string>
#include <vector>

#include "narrow_phase.h"

namespace pile {

// Compares the pairs that a space reported with those that dHashSpace reports for the same geoms.
//
// A geom can be in one space only, so the reference space holds a proxy of every geom: a geom of a
// user class whose AABB callback hands out the original's AABB, bit for bit, and which is on the
// same body. All filtering is then dHashSpace's own.
class PairCheck {
 public:
  // The geoms of a World, all enabled, with ODE's own category and collide bits; those without a
  // body never move. World::indexOf numbers them.
  explicit PairCheck(const std::vector<dGeomID>& geoms);
  ~PairCheck();
  PairCheck(const PairCheck&) = delete;
  PairCheck& operator=(const PairCheck&) = delete;

  // The first difference, in words; empty if the pairs are dHashSpace's, each once. If `ordered`,
  // they must also come in the order dParallelSAPSpace promises: ascending by (earlier, later).
  std::optional<std::string> compare(const std::vector<Pair>& pairs, bool ordered);

 private:
  dSpaceID reference_;
};

}  // namespace pile

#endif
