#ifndef PILE_MESH_H
#define PILE_MESH_H

#include <ode/ode.h>

#include <array>
#include <vector>

namespace pile {

// A triangle mesh in the layout that ODE reads in place. Triangles are counter-clockwise seen from
// outside (for a ground: from above), which is the side ODE's colliders take for the front.
struct Mesh {
  using Point = std::array<float, 3>;
  using Triangle = std::array<dTriIndex, 3>;

  std::vector<Point> points;
  std::vector<Triangle> triangles;
};

// Moves a closed mesh so that its centre of mass is the origin, and returns the mass, centred there
// too. Throws std::logic_error if the mesh is not closed or is inside out. (dMassSetTrimesh cannot
// be used: it shifts the inertia tensor by the centre of mass twice.)
dMass centreOfMass(Mesh& mesh, double density);

}  // namespace pile

#endif
