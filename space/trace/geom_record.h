// What a trace holds of a geom and of a body. Sees ODE's private headers.
#pragma once

#include <cstdint>

#include "space/geom/ode_private.h"
#include "space/trace/trace_file.h"
#include "space/trace/trace_format.h"

namespace ode_parallel_sap {

struct GeomRecord {
  // What seldom changes.
  struct Traits {
    std::uint32_t number, parent, geom_class, flags, body;
    std::uint64_t category_bits, collide_bits;
    dReal params[trace_format::params];

    bool operator==(const Traits& other) const;
  } traits;
  dReal pose[trace_format::pose];
  dReal bounds[trace_format::bounds];

  void put(TraceBytes& bytes) const;
};

struct BodyRecord {
  std::uint32_t number, flags;
  dReal pose[trace_format::pose];

  bool operator==(const BodyRecord& other) const;
  void put(TraceBytes& bytes) const;
};

// Of a geom that is up to date; its number, its parent's and its body's are the caller's.
GeomRecord recordOf(const dxGeom* geom);
BodyRecord recordOf(dBodyID body);

// Compares bits: a NaN is what it is.
template <std::size_t count>
bool sameReals(const dReal (&a)[count], const dReal (&b)[count]) {
  return std::memcmp(a, b, sizeof a) == 0;
}

}  // namespace ode_parallel_sap
