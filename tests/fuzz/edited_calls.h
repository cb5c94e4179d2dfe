// Calls whose callbacks edit the space, collide again, throw and leave by longjmp, checked against
// one rule: what has left since a call began is in none of its further reports, and what came takes
// part in calls that begin later.
#pragma once

#include <cstddef>
#include <string>

#include "../support/configurations.h"
#include "../support/random.h"

namespace sap_test {

// Makes a world of about so many geoms in spaces in spaces, on a configuration, or without one on
// the defaults, and some calls of it. Returns what was wrong, or "". With `jumps` callbacks are
// left by longjmp, too: ODE lets go of no such space, so its geoms stay to the end of the program.
std::string playEditedCalls(Random& random, const Configuration* configuration, std::size_t geoms,
                            int calls, bool jumps);

}  // namespace sap_test
