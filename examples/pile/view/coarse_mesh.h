#ifndef PILE_COARSE_MESH_H
#define PILE_COARSE_MESH_H

#include "../mesh.h"

namespace pile {

// The mesh with the points of each cell of a grid joined into their mean, and the triangles left
// out that have no area any more: what thousands of bodies of thousands of triangles each are drawn
// with. A mesh of few triangles is returned as it is.
Mesh coarseMesh(const Mesh& mesh);

}  // namespace pile

#endif
