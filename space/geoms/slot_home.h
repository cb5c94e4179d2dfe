// Where a geom keeps the number of its slot. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// In dxGeom::tome_ex, a field that ODE leaves to spaces for this; or, in forks of ODE without it,
// in dxGeom::tome, which is the space's, too: the pointer back to this geom in the list of the base
// class, read by ODE when a geom leaves that list and at no other time.
template <class Geom, class = void>
struct SlotHomeIn {
  static constexpr bool takes_tome = true;
  static dxGeom**& of(Geom* geom) { return geom->tome; }
};

template <class Geom>
struct SlotHomeIn<Geom, std::void_t<decltype(std::declval<Geom&>().tome_ex)>> {
  static constexpr bool takes_tome = false;
  static dxGeom**& of(Geom* geom) { return geom->tome_ex; }
};

struct SlotHome : SlotHomeIn<dxGeom> {
  static void put(dxGeom* geom, std::size_t number) {
    of(geom) = reinterpret_cast<dxGeom**>(number);
  }
  static std::size_t get(const dxGeom* geom) {
    return reinterpret_cast<std::size_t>(of(const_cast<dxGeom*>(geom)));
  }
};

}  // namespace ode_parallel_sap
