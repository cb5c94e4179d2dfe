// Which of ODE's colliders may run in several threads at once.
#pragma once

#include "space/geom/ode_private.h"

namespace ode_parallel_sap {

enum class ColliderUse {
  Light,          // any thread; about a microsecond, so many at a time
  Heavy,          // any thread; may take long, so few at a time
  Image,          // any thread that has an image of ODE which serves it, see collider_images.h
  CallingThread,  // the calling thread, when no other collides
};

// How dCollide (a, b) may be called; neither is a space. Only reads the geoms.
ColliderUse colliderUse(dxGeom* a, dxGeom* b);

}  // namespace ode_parallel_sap
