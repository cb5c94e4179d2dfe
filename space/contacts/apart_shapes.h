// What decides whether dCollide finds a contact of two shapes, one pair at a time. See
// certainly_apart.h.
#pragma once

#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ode_parallel_sap {
namespace apart_shapes {

// Bounds an error of ODE's in any rounding mode, and more than that of one here.
constexpr double epsilon = static_cast<double>(std::numeric_limits<dReal>::epsilon());
constexpr bool single = sizeof(dReal) == sizeof(float);

// Sizes of pairs for which nothing overflows, nor does what underflows matter, where ODE's
// colliders multiply lengths: up to four of them, divided by the sine of a small angle, for two
// capsules.
constexpr double least_size = single ? 0x1p-8 : 0x1p-200, most_size = single ? 0x1p28 : 0x1p200;

// ODE's colliders and the functions below add up at most some hundred products of lengths, of which
// `size` is the sum, with numbers of matrices and normals, all at most 2 (checked). 4096 epsilon of
// the size is several times all errors of both.
constexpr double rounding = 4096 * epsilon;

struct Vector {
  double x, y, z;
};
inline Vector operator+(const Vector& a, const Vector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vector operator-(const Vector& a, const Vector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vector operator*(double factor, const Vector& a) {
  return {factor * a.x, factor * a.y, factor * a.z};
}
inline double dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline double lengthOf(const Vector& a) {
  return std::sqrt(dot(a, a));
}
// The sum of magnitudes.
inline double sizeOf(const Vector& a) {
  return std::fabs(a.x) + std::fabs(a.y) + std::fabs(a.z);
}

// False where anything is NaN.
inline bool isBounded(double size) {
  return size >= least_size && size <= most_size;
}
inline bool isAxis(const Vector& axis) {
  return dot(axis, axis) <= 4;
}
// Of a place on an axis, to that part of it.
inline double clip(double x, double most) {
  return std::max(-most, std::min(x, most));
}

struct SphereShape {
  Vector centre;
  double radius;
};

struct PlaneShape {  // normal * x <= distance
  Vector normal;
  double distance;
};

struct BoxShape {
  Vector centre, axis[3];
  double half[3];  // sides

  bool isSound() const {
    return half[0] >= 0 && half[1] >= 0 && half[2] >= 0 &&
           dot(axis[0], axis[0]) + dot(axis[1], axis[1]) + dot(axis[2], axis[2]) <= 4;
  }
  double size() const { return half[0] + half[1] + half[2]; }
  // Of a place relative to the centre, or of one in the box.
  Vector inside(const Vector& p) const {
    return {dot(p, axis[0]), dot(p, axis[1]), dot(p, axis[2])};
  }
  Vector outside(const Vector& t) const { return t.x * axis[0] + t.y * axis[1] + t.z * axis[2]; }
  Vector clipped(const Vector& t) const {
    return {clip(t.x, half[0]), clip(t.y, half[1]), clip(t.z, half[2])};
  }
  // How far it reaches along n.
  double reach(const Vector& n) const {
    return half[0] * std::fabs(dot(n, axis[0])) + half[1] * std::fabs(dot(n, axis[1])) +
           half[2] * std::fabs(dot(n, axis[2]));
  }
};

struct CapsuleShape {
  Vector centre, axis;
  double half, radius;  // of the length

  bool isSound() const { return half >= 0 && isAxis(axis); }
  // Ends are computed from the centre in space, and rounded as such.
  double size() const { return sizeOf(centre) + half + std::fabs(radius); }
  double clipped(double along) const { return clip(along, half); }
  Vector at(double along) const { return centre + along * axis; }
};

// Whether the points of two shapes that reach so far along n from centres `between` each other are
// further apart than `distance`: a certificate that does not depend on how n was found.
inline bool isBetween(const Vector& n, const Vector& between, double reach, double distance) {
  const double length = lengthOf(n);
  return length > 0 && std::fabs(dot(n, between)) - reach > distance * length;
}

// areApart() is true only if dCollide certainly returns 0. All need exactMode().

// dCollideSpheres: the distance of the centres against the sum of the radii.
inline bool areApart(const SphereShape& a, const SphereShape& b) {
  const Vector between = b.centre - a.centre;
  const double radii = a.radius + b.radius;
  const double size = sizeOf(between) + std::fabs(a.radius) + std::fabs(b.radius);
  return isBounded(size) && lengthOf(between) > radii + rounding * size;
}

// dCollideSphereBox clips the centre to the box. One that it does not find outside touches.
inline bool areApart(const SphereShape& sphere, const BoxShape& box) {
  const Vector between = sphere.centre - box.centre;
  const double size = sizeOf(between) + box.size() + std::fabs(sphere.radius);
  if (!box.isSound() || !isBounded(size)) return false;
  const double error = rounding * size;
  const Vector t = box.inside(between);
  if (!(std::fabs(t.x) > box.half[0] + error || std::fabs(t.y) > box.half[1] + error ||
        std::fabs(t.z) > box.half[2] + error))
    return false;
  return lengthOf(between - box.outside(box.clipped(t))) > sphere.radius + error;
}

inline bool areApart(const SphereShape& sphere, const PlaneShape& plane) {
  const double size = sizeOf(sphere.centre) + std::fabs(plane.distance) + std::fabs(sphere.radius);
  return isAxis(plane.normal) && isBounded(size) &&
         dot(plane.normal, sphere.centre) - plane.distance - sphere.radius > rounding * size;
}

// dCollideCapsuleSphere: two spheres, one at that place of the capsule's axis which is nearest.
inline bool areApart(const CapsuleShape& capsule, const SphereShape& sphere) {
  const double size = capsule.size() + sizeOf(sphere.centre) + std::fabs(sphere.radius);
  if (!capsule.isSound() || !isBounded(size)) return false;
  const Vector nearest =
      capsule.at(capsule.clipped(dot(capsule.axis, sphere.centre - capsule.centre)));
  return lengthOf(sphere.centre - nearest) > capsule.radius + sphere.radius + rounding * size;
}

// dCollideCapsuleBox: two spheres, one of no radius, at a place on the capsule's axis and one in
// the box, whichever it finds; or two boxes if these are closer than 1e-15 (1e-6 in single
// precision).
inline bool areApart(const CapsuleShape& capsule, const BoxShape& box) {
  const double size = capsule.size() + sizeOf(box.centre) + box.size();
  if (!capsule.isSound() || !box.isSound() || !isBounded(size)) return false;
  const Vector between = capsule.centre - box.centre;
  const Vector start = box.inside(between), along = box.inside(capsule.axis);
  // From one to the other by turns; where that ends too early no harm is done.
  double place = capsule.clipped(-dot(start, along) / dot(along, along));
  Vector apart = {};
  for (int turn = 0; turn < 3; ++turn) {
    const Vector on_axis = start + place * along;
    const Vector in_box = box.clipped(on_axis);
    apart = on_axis - in_box;
    place = capsule.clipped(dot(in_box - start, along) / dot(along, along));
  }
  const Vector n = box.outside(apart);
  constexpr double least_distance = single ? 2e-6 : 2e-15;
  return isBetween(n, between, capsule.half * std::fabs(dot(n, capsule.axis)) + box.reach(n),
                   std::max(capsule.radius, least_distance) + rounding * size);
}

// The places on the axes of two capsules, not parallel, that are nearest to each other.
inline Vector betweenNearest(const CapsuleShape& a, const CapsuleShape& b, double cosine,
                             double squared_sine) {
  const Vector between = b.centre - a.centre;
  const double on_a = dot(a.axis, between), on_b = dot(b.axis, between);
  const double at_a = a.clipped((on_a - cosine * on_b) / squared_sine);
  const double at_b = b.clipped(cosine * at_a - on_b);
  const double again = a.clipped(cosine * at_b + on_a);
  return b.at(at_b) - a.at(again);
}

// Whether two capsules, parallel for all that ODE can see, are certainly beside each other for a
// while: it then takes places of both axes in that range.
inline bool areBeside(const CapsuleShape& a, const CapsuleShape& b, double error) {
  const double shift = std::fabs(dot(a.axis, b.centre - a.centre));
  return a.half > 0 && b.half > 0 && shift + 4 * error < a.half + b.half;
}

// dCollideCapsuleCapsule: two spheres at places on the axes. Below 1 - cosine^2 = 1e-5 the axes
// count as parallel; then, where the capsules are not beside each other, and where an axis is so
// short beside its distance from the origin that its ends, rounded, have another direction, the
// places may be anywhere on lines that are no longer the axes. Above, they are off by errors that
// are divided by 1 - cosine^2.
inline bool areApart(const CapsuleShape& a, const CapsuleShape& b) {
  const double size = a.size() + b.size();
  constexpr double unit_error = 0x1p-20;  // fixed: far beyond the rounding of an axis
  if (!isBounded(size) || !(a.half >= 0) || !(b.half >= 0) ||
      !(std::fabs(dot(a.axis, a.axis) - 1) <= unit_error) ||
      !(std::fabs(dot(b.axis, b.axis) - 1) <= unit_error))
    return false;
  const double least_half = 4 * rounding * size;
  if ((a.half > 0 && a.half < least_half) || (b.half > 0 && b.half < least_half)) return false;
  const double cosine = dot(a.axis, b.axis), squared_sine = 1 - cosine * cosine;
  double error = rounding * size;
  Vector n;
  if (squared_sine >= 2e-5) {
    error /= squared_sine;
    n = betweenNearest(a, b, cosine, squared_sine);
  } else if (squared_sine < 5e-6 && areBeside(a, b, error)) {
    const Vector between = b.centre - a.centre;
    n = between - dot(a.axis, between) * a.axis;
  } else {
    return false;
  }
  return isBetween(n, b.centre - a.centre,
                   a.half * std::fabs(dot(n, a.axis)) + b.half * std::fabs(dot(n, b.axis)),
                   a.radius + b.radius + error);
}

// dCollideCapsulePlane looks at the deeper end.
inline bool areApart(const CapsuleShape& capsule, const PlaneShape& plane) {
  const double size = capsule.size() + std::fabs(plane.distance);
  if (!capsule.isSound() || !isAxis(plane.normal) || !isBounded(size)) return false;
  const double height =
      dot(plane.normal, capsule.centre) - capsule.half * std::fabs(dot(plane.normal, capsule.axis));
  return height - plane.distance - capsule.radius > rounding * size;
}

// dCollideBoxPlane looks at the deepest corner.
inline bool areApart(const BoxShape& box, const PlaneShape& plane) {
  const double size = sizeOf(box.centre) + box.size() + std::fabs(plane.distance);
  if (!box.isSound() || !isAxis(plane.normal) || !isBounded(size)) return false;
  return dot(plane.normal, box.centre) - box.reach(plane.normal) - plane.distance > rounding * size;
}

}  // namespace apart_shapes
}  // namespace ode_parallel_sap
