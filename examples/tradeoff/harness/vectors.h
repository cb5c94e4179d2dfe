#ifndef TRADEOFF_HARNESS_VECTORS_H
#define TRADEOFF_HARNESS_VECTORS_H

#include <ode/ode.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace tradeoff {

using Vector = std::array<double, 3>;

inline Vector vectorOf(const dReal* values) {
  return {static_cast<double>(values[0]), static_cast<double>(values[1]),
          static_cast<double>(values[2])};
}

inline Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline void addScaled(Vector& sum, double scale, const Vector& term) {
  for (size_t i = 0; i < 3; ++i) sum[i] += scale * term[i];
}

inline Vector minus(Vector a, const Vector& b) {
  addScaled(a, -1, b);
  return a;
}

inline double length(const Vector& v) {
  return std::sqrt(dot(v, v));
}

inline double massOf(dBodyID body) {
  dMass mass;
  dBodyGetMass(body, &mass);
  return static_cast<double>(mass.mass);
}

// Angular momentum about the body's own centre.
inline Vector spinOf(dBodyID body) {
  dMass mass;
  dBodyGetMass(body, &mass);
  const Vector rate = vectorOf(dBodyGetAngularVel(body));
  const dReal* r = dBodyGetRotation(body);
  Vector local = {0, 0, 0}, turned = {0, 0, 0}, spin = {0, 0, 0};
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) local[i] += static_cast<double>(r[4 * j + i]) * rate[j];
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) turned[i] += static_cast<double>(mass.I[4 * i + j]) * local[j];
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) spin[i] += static_cast<double>(r[4 * i + j]) * turned[j];
  return spin;
}

inline Vector gravityOf(dWorldID world) {
  dVector3 gravity;
  dWorldGetGravity(world, gravity);
  return vectorOf(gravity);
}

inline double spinEnergyOf(dBodyID body) {
  return dot(vectorOf(dBodyGetAngularVel(body)), spinOf(body)) / 2;
}

// Of every bit of every body's state (FNV-1a by Fowler, Noll, Vo), after what came before.
inline uint64_t digestOf(const std::vector<dBodyID>& bodies,
                         uint64_t before = 14695981039346656037u) {
  const auto add = [&before](const dReal* values, size_t count) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(values);
    for (size_t i = 0; i < count * sizeof(dReal); ++i)
      before = (before ^ bytes[i]) * 1099511628211u;
  };
  for (dBodyID body : bodies) {
    add(dBodyGetPosition(body), 3);
    add(dBodyGetQuaternion(body), 4);
    add(dBodyGetLinearVel(body), 3);
    add(dBodyGetAngularVel(body), 3);
  }
  return before;
}

}  // namespace tradeoff

#endif
