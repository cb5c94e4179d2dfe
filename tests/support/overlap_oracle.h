// The overlaps that a batch of probes owes: a loop over dSpaceCollide2 and dCollide.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <string>
#include <vector>

#include "contact_scene.h"
#include "ray_oracle.h"

namespace sap_test {

using Probes = std::vector<dParallelSAPProbe>;

// Of each probe.
std::vector<Contacts> owedOverlaps(dSpaceID space, const Probes& probes, int flags,
                                   const Filter& filter = nullptr);

// What the callback gets, what is counted and what is only said to be or not, bit for bit: "" or
// where they differ from what is owed.
std::string wrongOverlaps(dSpaceID space, const Probes& probes, int flags,
                          const std::vector<Contacts>& owed);

}  // namespace sap_test
