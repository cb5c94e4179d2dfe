// Which of ODE's colliders may run in several threads at once.
#pragma once

#include "space/geom/ode_private.h"

namespace ode_parallel_sap {

enum class ColliderUse {
  Light,          // any thread; about a microsecond, so many at a time
  Heavy,          // any thread; may take long, so few at a time
  Image,          // any thread that has a collider of its own for it, see thread_colliders.h
  CallingThread,  // the calling thread, when no other collides
};

// How dCollide (a, b) may be called; neither is a space. Only reads the geoms.
ColliderUse colliderUse(dxGeom* a, dxGeom* b);

// The program's dCollide, for a calling thread, while others may collide geoms of their own. Where
// the colliders of meshes share a cache, threads take turns at them. Meshes with callbacks do not:
// the program's code is not to run while another thread waits for it.
int collideInTurn(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip);

}  // namespace ode_parallel_sap
