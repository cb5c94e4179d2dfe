// Stand-ins for geoms that a collider of ODE writes to. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <vector>

#include "space/contacts/ode_image.h"

namespace ode_parallel_sap {

// ODE's collider of heightfields keeps its triangles in the heightfield and its contacts with a
// plane in the heightfield's data, and puts the other geom, or its body, into the heightfield's
// frame for a while. Here it does all that to copies: the heightfield and the data are the image's,
// which takes on the values of the program's; of the other geom, bytes and pose are copied into
// storage that is reused. None of it is left in the contacts.
//
// Whatever the collider reads it has written before, for the same pair, so contacts do not depend
// on what the buffers held.
class GeomCopies {
 public:
  // Whether the geoms can be stood in for: a heightfield whose heights are no callback's, with a
  // class of known size.
  static bool serve(const OdeImage& image, const dxGeom* a, const dxGeom* b);
  // As dCollide, of a heightfield and another geom in either order.
  int collide(const OdeImage& image, dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts,
              int skip);

 private:
  dxGeom* copyOf(const OdeImage& image, const dxGeom* geom);

  std::vector<double> bytes_;  // of the other geom
  dxPosR pose_;
};

}  // namespace ode_parallel_sap
