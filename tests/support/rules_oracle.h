// Spaces that leave pairs out, or let some more through: skip static, skip asleep, cull planes,
// tolerance. Which pairs they owe, which they may report, and which they must not.
#pragma once

#include <ode/ode.h>

#include <functional>
#include <string>
#include <vector>

#include "recorder.h"

namespace sap_test {

struct Rules {
  bool skip_static = false, skip_asleep = false, cull_planes = false;
  dReal tolerance = 0;

  // Those of a space; none of one that is not ours.
  static Rules of(dSpaceID space);
};

// "" or what is wrong first with pairs that were reported by a space with these rules, to which
// geoms were added in this order.
std::string wrongByRules(const Rules& rules, const std::vector<dGeomID>& in_add_order,
                         const Pairs& got);

// Whether a pair that was reported does not end although it is left out: because it rests.
enum class Rest { no, yes, either };
Rest restOf(const Rules& rules, dGeomID a, dGeomID b);

// "" or which of the last collide's counts of geoms and pairs is not that of these geoms, in their
// state of that collide, and of as many reported pairs.
std::string wrongCounts(dSpaceID space, const std::vector<dGeomID>& all, std::size_t pairs);

// Of `all` pairs those that culled planes owe, or did report where rounding decides.
Pairs withoutCulled(const Pairs& all, const Pairs& got,
                    const std::function<dGeomID(std::size_t)>& geomOf);

}  // namespace sap_test
