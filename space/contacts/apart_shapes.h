// What decides whether dCollide finds a contact of two shapes, one pair at a time. See
// certainly_apart.h.
#ifndef ODE_PARALLEL_SAP_APART_SHAPES_H
#define ODE_PARALLEL_SAP_APART_SHAPES_H

#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ode_parallel_sap {
namespace apart_shapes {

// Poses are ODE's: matrices of three rows of four numbers each, whose columns are axes.
struct BallShape {
  const dReal* centre;
  double radius;
};
struct RodShape {  // a capsule, along the third axis
  const dReal* centre;
  const dReal* matrix;
  double radius, length;
};
struct BrickShape {
  const dReal* centre;
  const dReal* matrix;
  const dReal* sides;
};
struct HalfSpaceShape {  // normal * x <= distance
  const dReal* plane;
};

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
inline Vector vectorOf(const dReal* v) {
  return {v[0], v[1], v[2]};
}
inline Vector columnOf(const dReal* matrix, int column) {
  return {matrix[column], matrix[4 + column], matrix[8 + column]};
}

// False where anything is NaN.
inline bool isBounded(double size) {
  return size >= least_size && size <= most_size;
}
inline bool isAxis(const Vector& axis) {
  return dot(axis, axis) <= 4;
}

struct Brick {
  Vector axis[3];
  double half[3];

  explicit Brick(const BrickShape& shape) {
    for (int i = 0; i < 3; ++i) {
      axis[i] = columnOf(shape.matrix, i);
      half[i] = 0.5 * shape.sides[i];
    }
  }
  bool isSound() const {
    return half[0] >= 0 && half[1] >= 0 && half[2] >= 0 &&
           dot(axis[0], axis[0]) + dot(axis[1], axis[1]) + dot(axis[2], axis[2]) <= 4;
  }
  double size() const { return half[0] + half[1] + half[2]; }
  // Of a place relative to the centre, or of one in the brick.
  Vector inside(const Vector& p) const {
    return {dot(p, axis[0]), dot(p, axis[1]), dot(p, axis[2])};
  }
  Vector outside(const Vector& t) const { return t.x * axis[0] + t.y * axis[1] + t.z * axis[2]; }
  Vector clip(const Vector& t) const {
    return {clip(t.x, half[0]), clip(t.y, half[1]), clip(t.z, half[2])};
  }
  // How far it reaches along n.
  double reach(const Vector& n) const {
    return half[0] * std::fabs(dot(n, axis[0])) + half[1] * std::fabs(dot(n, axis[1])) +
           half[2] * std::fabs(dot(n, axis[2]));
  }

 private:
  static double clip(double x, double most) { return std::max(-most, std::min(x, most)); }
};

struct Rod {
  Vector centre, axis;
  double half, radius;

  explicit Rod(const RodShape& shape)
      : centre(vectorOf(shape.centre)),
        axis(columnOf(shape.matrix, 2)),
        half(0.5 * shape.length),
        radius(shape.radius) {}
  bool isSound() const { return half >= 0 && isAxis(axis); }
  // Ends are computed from the centre in space, and rounded as such.
  double size() const { return sizeOf(centre) + half + std::fabs(radius); }
  double clip(double along) const { return std::max(-half, std::min(along, half)); }
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
inline bool areApart(const BallShape& a, const BallShape& b) {
  const Vector between = vectorOf(b.centre) - vectorOf(a.centre);
  const double radii = a.radius + b.radius;
  const double size = sizeOf(between) + std::fabs(a.radius) + std::fabs(b.radius);
  return isBounded(size) && lengthOf(between) > radii + rounding * size;
}

// dCollideSphereBox clips the centre to the box. One that it does not find outside touches.
inline bool areApart(const BallShape& ball, const BrickShape& shape) {
  const Brick brick(shape);
  const Vector between = vectorOf(ball.centre) - vectorOf(shape.centre);
  const double size = sizeOf(between) + brick.size() + std::fabs(ball.radius);
  if (!brick.isSound() || !isBounded(size)) return false;
  const double error = rounding * size;
  const Vector t = brick.inside(between);
  if (!(std::fabs(t.x) > brick.half[0] + error || std::fabs(t.y) > brick.half[1] + error ||
        std::fabs(t.z) > brick.half[2] + error))
    return false;
  return lengthOf(between - brick.outside(brick.clip(t))) > ball.radius + error;
}

inline bool areApart(const BallShape& ball, const HalfSpaceShape& half_space) {
  const Vector normal = vectorOf(half_space.plane), centre = vectorOf(ball.centre);
  const double distance = half_space.plane[3];
  const double size = sizeOf(centre) + std::fabs(distance) + std::fabs(ball.radius);
  return isAxis(normal) && isBounded(size) &&
         dot(normal, centre) - distance - ball.radius > rounding * size;
}

// dCollideCapsuleSphere: two spheres, one at that place of the capsule's axis which is nearest.
inline bool areApart(const RodShape& shape, const BallShape& ball) {
  const Rod rod(shape);
  const Vector centre = vectorOf(ball.centre);
  const double size = rod.size() + sizeOf(centre) + std::fabs(ball.radius);
  if (!rod.isSound() || !isBounded(size)) return false;
  const Vector nearest = rod.at(rod.clip(dot(rod.axis, centre - rod.centre)));
  return lengthOf(centre - nearest) > rod.radius + ball.radius + rounding * size;
}

// dCollideCapsuleBox: two spheres, one of no radius, at a place on the capsule's axis and one in
// the box, whichever it finds; or two boxes if these are closer than 1e-15 (1e-6 in single
// precision).
inline bool areApart(const RodShape& rod_shape, const BrickShape& brick_shape) {
  const Rod rod(rod_shape);
  const Brick brick(brick_shape);
  const Vector centre = vectorOf(brick_shape.centre);
  const double size = rod.size() + sizeOf(centre) + brick.size();
  if (!rod.isSound() || !brick.isSound() || !isBounded(size)) return false;
  const Vector between = rod.centre - centre;
  const Vector start = brick.inside(between), along = brick.inside(rod.axis);
  // From one to the other by turns; where that ends too early no harm is done.
  double place = rod.clip(-dot(start, along) / dot(along, along));
  Vector apart = {};
  for (int turn = 0; turn < 3; ++turn) {
    const Vector on_axis = start + place * along;
    const Vector in_brick = brick.clip(on_axis);
    apart = on_axis - in_brick;
    place = rod.clip(dot(in_brick - start, along) / dot(along, along));
  }
  const Vector n = brick.outside(apart);
  constexpr double least_distance = single ? 2e-6 : 2e-15;
  return isBetween(n, between, rod.half * std::fabs(dot(n, rod.axis)) + brick.reach(n),
                   std::max(rod.radius, least_distance) + rounding * size);
}

// The places on the axes of two rods, not parallel, that are nearest to each other.
inline Vector betweenNearest(const Rod& a, const Rod& b, double cosine, double squared_sine) {
  const Vector between = b.centre - a.centre;
  const double on_a = dot(a.axis, between), on_b = dot(b.axis, between);
  const double at_a = a.clip((on_a - cosine * on_b) / squared_sine);
  const double at_b = b.clip(cosine * at_a - on_b);
  const double again = a.clip(cosine * at_b + on_a);
  return b.at(at_b) - a.at(again);
}

// Whether two rods, parallel for all that ODE can see, are certainly beside each other for a while:
// it then takes places of both axes in that range.
inline bool areBeside(const Rod& a, const Rod& b, double error) {
  const double shift = std::fabs(dot(a.axis, b.centre - a.centre));
  return a.half > 0 && b.half > 0 && shift + 4 * error < a.half + b.half;
}

// dCollideCapsuleCapsule: two spheres at places on the axes. Below 1 - cosine^2 = 1e-5 the axes
// count as parallel; then, where the capsules are not beside each other, and where an axis is so
// short beside its distance from the origin that its ends, rounded, have another direction, the
// places may be anywhere on lines that are no longer the axes. Above, they are off by errors that
// are divided by 1 - cosine^2.
inline bool areApart(const RodShape& first, const RodShape& second) {
  const Rod a(first), b(second);
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
inline bool areApart(const RodShape& shape, const HalfSpaceShape& half_space) {
  const Rod rod(shape);
  const Vector normal = vectorOf(half_space.plane);
  const double distance = half_space.plane[3];
  const double size = rod.size() + std::fabs(distance);
  if (!rod.isSound() || !isAxis(normal) || !isBounded(size)) return false;
  const double height = dot(normal, rod.centre) - rod.half * std::fabs(dot(normal, rod.axis));
  return height - distance - rod.radius > rounding * size;
}

// dCollideBoxPlane looks at the deepest corner.
inline bool areApart(const BrickShape& shape, const HalfSpaceShape& half_space) {
  const Brick brick(shape);
  const Vector normal = vectorOf(half_space.plane), centre = vectorOf(shape.centre);
  const double distance = half_space.plane[3];
  const double size = sizeOf(centre) + brick.size() + std::fabs(distance);
  if (!brick.isSound() || !isAxis(normal) || !isBounded(size)) return false;
  return dot(normal, centre) - brick.reach(normal) - distance > rounding * size;
}

}  // namespace apart_shapes
}  // namespace ode_parallel_sap

#endif
