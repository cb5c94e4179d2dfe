// Which numbers of contacts a collider has written.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace ode_parallel_sap {

// ODE's colliders leave the fourth number of a contact's position or normal as the caller had it,
// or write it, as it comes. Contacts that are copied to the caller must do the same. So those
// numbers are made signalling NaNs first, which no arithmetic returns.
using NumberBits =
    std::conditional<sizeof(dReal) == sizeof(double), std::uint64_t, std::uint32_t>::type;
constexpr NumberBits unwritten_number =
    static_cast<NumberBits>(sizeof(dReal) == sizeof(double) ? 0x7ff4a5c35a3ca5c3 : 0x7fa5a5c3);

// A pair with more contacts is not told: room for so many is marked for every pair.
constexpr std::uint32_t most_precomputed_contacts = 16;  // fixed: boxes have eight, few others more

inline void markUnwritten(dContactGeom* contacts, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(&contacts[i].pos[3], &unwritten_number, sizeof unwritten_number);
    std::memcpy(&contacts[i].normal[3], &unwritten_number, sizeof unwritten_number);
  }
}

// Copies four numbers, or three.
inline void copyWritten(const dReal* from, dReal* to) {
  NumberBits fourth;
  std::memcpy(&fourth, &from[3], sizeof fourth);
  std::memcpy(to, from, 3 * sizeof *to);
  if (fourth != unwritten_number) std::memcpy(&to[3], &fourth, sizeof fourth);
}

inline void copyWritten(const dContactGeom& from, dContactGeom& to) {
  copyWritten(from.pos, to.pos);
  copyWritten(from.normal, to.normal);
  to.depth = from.depth;
  to.g1 = from.g1;
  to.g2 = from.g2;
  to.side1 = from.side1;
  to.side2 = from.side2;
}

}  // namespace ode_parallel_sap
