#include "space/frame/geoms_ahead.h"

#include <cstdint>

#include "space/base/platform.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// Of the nearer one its body, and what the program hangs on it. That need not be an address.
void GeomsAhead::prefetchFor(const dxGeom* far, const dxGeom* near) {
  constexpr std::uintptr_t least_address = 4096;  // fixed: nobody maps the first page
  prefetch(&far->body);
  if (near->body) prefetch(near->body);
  if (reinterpret_cast<std::uintptr_t>(near->data) >= least_address) prefetch(near->data);
}

}  // namespace ode_parallel_sap
