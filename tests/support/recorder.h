// Pairs as the callback receives them, by the numbers that the test gave its geoms.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace sap_test {

// (first argument of the callback, second argument).
using Pair = std::pair<std::size_t, std::size_t>;
using Pairs = std::vector<Pair>;

inline dGeomID asGeom(dSpaceID space) {
  return reinterpret_cast<dGeomID>(space);
}

// The number travels in the geom's data pointer.
void setNumber(dGeomID geom, std::size_t number);
std::size_t number(dGeomID geom);

// A dNearCallback; `pairs` points to a Pairs, to which the pair is appended.
void record(void* pairs, dGeomID first, dGeomID second);

// The same, which takes spaces apart all the way down.
void recordWithin(void* pairs, dGeomID first, dGeomID second);

Pairs collide(dSpaceID space);
// What dSpaceCollide reports until its callback throws, at its call number `at`, counted from 1.
Pairs collideUntil(dSpaceID space, std::size_t at);
Pairs collide2(dGeomID first, dGeomID second);
inline Pairs collide2(dSpaceID first, dGeomID second) {
  return collide2(asGeom(first), second);
}

// A callback of any kind whose data is a function object, which it calls.
template <class Function, class Result, class... Arguments>
Result invoke(void* function, Arguments... arguments) {
  return (*static_cast<Function*>(function))(arguments...);
}
template <class Function>
void collide(dSpaceID space, Function function) {
  dSpaceCollide(space, &function, invoke<Function>);
}
template <class Function>
void collide2(dGeomID first, dGeomID second, Function function) {
  dSpaceCollide2(first, second, &function, invoke<Function>);
}

// Sorted, arguments as they are.
Pairs sorted(Pairs pairs);
// Sorted, the smaller number first in every pair: for spaces that promise no order of arguments.
Pairs asSet(Pairs pairs);

// Empty if both are the same, else where they begin to differ. For use as
// REQUIRE(difference(got, expected) == "").
std::string difference(const Pairs& got, const Pairs& expected);

}  // namespace sap_test
