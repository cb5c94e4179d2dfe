// Contacts of single pairs, for programs that ask for them one by one.
#include <algorithm>

#include "space/contacts/narrow_phase.h"
#include "space/contacts/written_numbers.h"
#include "space/geom/ode_private.h"

namespace ode_parallel_sap {

void NarrowPhase::precomputeNothing() {
  found_.resizeDiscarding(0);
  for (Share& share : shares_) share.contacts.resizeDiscarding(0);
}

std::size_t NarrowPhase::precomputed() const {
  return static_cast<std::size_t>(std::count_if(
      found_.begin(), found_.end(), [](const Found& found) { return found.thread != nobody; }));
}

// ODE takes the quaternion of a body as it is, and makes a geom's own from its matrix. It takes a
// body from a geom without a trace, as that stays where it is.
std::uint16_t NarrowPhase::bodiesOf(const dParallelSAPPair& pair) {
  return static_cast<std::uint16_t>((pair.o1->body ? 1 : 0) | (pair.o2->body ? 2 : 0) |
                                    (pair.o1->offset_posr ? 4 : 0) |
                                    (pair.o2->offset_posr ? 8 : 0));
}

int NarrowPhase::tell(std::size_t place, const dParallelSAPPair& pair, dContactGeom* contacts,
                      int skip) const {
  const Found& found = found_[place];
  if (found.thread == nobody || found.bodies != bodiesOf(pair)) return -1;
  const dContactGeom* const told = shares_[found.thread].contacts.data() + found.first;
  for (std::uint32_t i = 0; i < found.count; ++i)
    copyWritten(told[i], *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(contacts) +
                                                          static_cast<std::ptrdiff_t>(i) * skip));
  return static_cast<int>(found.count);
}

}  // namespace ode_parallel_sap
