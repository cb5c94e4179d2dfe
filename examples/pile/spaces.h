#ifndef PILE_SPACES_H
#define PILE_SPACES_H

#include <ode/ode.h>

#include <string>

#include "options.h"

namespace pile {

// Creates the space that the options ask for, empty. Throws UsageError where a method or back end
// is not to be had.
dSpaceID createSpace(const Options& options);

// What a space is, and for ours what its last collide used: "dParallelSAPSpace (sweep, cpu)".
std::string describeSpace(dSpaceID space);

}  // namespace pile

#endif
