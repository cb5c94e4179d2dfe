// What decides whether dCollide finds a contact of two shapes, one pair at a time. See
// certainly_apart.h.
#ifndef ODE_PARALLEL_SAP_APART_SHAPES_H
#define ODE_PARALLEL_SAP_APART_SHAPES_H

#include <ode/ode.h>

namespace ode_parallel_sap {

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
  dVector3 sides;
};
struct HalfSpaceShape {  // normal * x <= distance
  dVector4 plane;
};

// True only if dCollide certainly returns 0. Needs exactMode().
bool areApart(const BallShape& a, const BallShape& b);
bool areApart(const BallShape& ball, const BrickShape& brick);
bool areApart(const BallShape& ball, const HalfSpaceShape& half_space);
bool areApart(const RodShape& rod, const BallShape& ball);
bool areApart(const RodShape& rod, const BrickShape& brick);
bool areApart(const RodShape& a, const RodShape& b);
bool areApart(const RodShape& rod, const HalfSpaceShape& half_space);
bool areApart(const BrickShape& brick, const HalfSpaceShape& half_space);

}  // namespace ode_parallel_sap

#endif
