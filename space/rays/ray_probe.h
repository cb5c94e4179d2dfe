// A ray of ODE's that a thread casts one ray after the other with. Sees ODE's private headers.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cmath>
#include <limits>

#include "space/base/buffer.h"
#include "space/contacts/collider_threads.h"
#include "space/contacts/thread_colliders.h"
#include "space/geoms/geom_tests.h"

namespace ode_parallel_sap {

class RayProbe {
 public:
  // As the flags of dParallelSAPSpaceRays. To be made and destroyed by the calling thread.
  explicit RayProbe(int flags)
      : most_contacts_(flags & most_contacts_mask), ray_(dCreateRay(nullptr, 1)) {
    if (most_contacts_ == 0) most_contacts_ = 1;
    // Forks of ODE have other functions for these.
    if (flags & dParallelSAPRayFirstContact) ray_->gflags |= RAY_FIRSTCONTACT;
    if (flags & dParallelSAPRayBackfaceCull) ray_->gflags |= RAY_BACKFACECULL;
    if (flags & dParallelSAPRayClosestHit) ray_->gflags |= RAY_CLOSEST_HIT;
  }
  ~RayProbe() { dGeomDestroy(ray_); }
  RayProbe(const RayProbe&) = delete;
  RayProbe& operator=(const RayProbe&) = delete;

  // False where it can hit nothing.
  bool aim(const dParallelSAPRay& ray) {
    if (!isRay(ray)) return false;
    const dReal *const at = ray.origin, *const to = ray.direction;
    dGeomRaySet(ray_, at[0], at[1], at[2], to[0], to[1], to[2]);
    dGeomRaySetLength(ray_, ray.length);
    const bool all_bits = ray.category_bits == 0 && ray.collide_bits == 0;
    ray_->category_bits = all_bits ? ~0ul : ray.category_bits;
    ray_->collide_bits = all_bits ? ~0ul : ray.collide_bits;
    updateAABB(ray_);
    return !hasNaN(ray_);
  }
  dxGeom* geom() const { return ray_; }
  const dReal* origin() const { return ray_->final_posr->pos; }
  // As ODE has made it of length 1.
  void direction(dReal* direction) const {
    for (int axis = 0; axis < 3; ++axis) direction[axis] = ray_->final_posr->R[4 * axis + 2];
  }

  // dCollide of the ray and a geom: the number of contacts.
  int collide(dxGeom* geom, ThreadCollider* image) {
    constexpr int skip = sizeof(dContactGeom);
    contacts_.resizeDiscarding(static_cast<std::size_t>(most_contacts_));
    dContactGeom* const found = contacts_.data();
    return image ? image->collide(ray_, geom, most_contacts_, found, skip)
                 : collideInTurn(ray_, geom, most_contacts_, found, skip);
  }
  const dContactGeom& contact(int i) const { return contacts_[static_cast<std::size_t>(i)]; }

 private:
  static constexpr int most_contacts_mask = 0xffff;  // as of dCollide

  static bool isRay(const dParallelSAPRay& ray) {
    bool finite = true, directed = false;
    for (int axis = 0; axis < 3; ++axis) {
      finite = finite && std::isfinite(ray.origin[axis]) && std::isfinite(ray.direction[axis]);
      directed = directed || ray.direction[axis] != 0;
    }
    return finite && directed && ray.length >= 0;
  }

  int most_contacts_;
  dxGeom* const ray_;
  Buffer<dContactGeom> contacts_;
};

}  // namespace ode_parallel_sap
