// Which contacts of a pair to keep: what reduce callbacks of dParallelSAPSpaceCollideContacts call.
#pragma once

#include <ode/ode.h>

namespace ode_parallel_sap {

// Both put the contacts that are kept first, in the order in which they were chosen, leave the
// others behind them in their order, and return how many are kept: `most`, or all of fewer. Never
// kept are contacts without a normal or with a number that is not finite, and last those that lie
// beside an AABB of their geoms. Of equals the earlier one is chosen. They need no memory but the
// stack.

// The deepest ones, deepest first.
int keepDeepest(dContactGeom* contacts, int count, int most);

// The deepest one, the one farthest from it, and then always the one that adds most to the area of
// the convex hull of those chosen, seen along the normal of the first one. Where none adds any, the
// deepest of the rest. Where a contact is too far away for its distance to be a number it counts as
// one that adds nothing.
int keepSpread(dContactGeom* contacts, int count, int most);

// Whether a contact's depth, normal and place are numbers that a joint can use.
bool isFinite(const dContactGeom& contact);

}  // namespace ode_parallel_sap
