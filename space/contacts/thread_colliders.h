// Colliders of ODE for several threads at once, where these share caches in the program's ODE.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <vector>

namespace ode_parallel_sap {

// One thread's.
class ThreadCollider {
 public:
  virtual ~ThreadCollider() = default;
  // Whether collide() does what the program's dCollide would do, the program's geoms apart, to
  // which it does nothing. Of the pairs that colliderUse() means for it.
  virtual bool serves(const dxGeom* a, const dxGeom* b) const = 0;
  // As dCollide.
  virtual int collide(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip) = 0;
};

// Colliders that are lent to this object as long as it lives: one for each of up to `wanted`
// threads, for so many pairs. None where there are not two of them: then the calling thread
// collides. Lent by space/images, or by no_thread_colliders.cpp in a build without it.
class ThreadColliders {
 public:
  ThreadColliders(int wanted, std::size_t pairs);
  ~ThreadColliders();
  ThreadColliders(const ThreadColliders&) = delete;
  ThreadColliders& operator=(const ThreadColliders&) = delete;

  int count() const { return static_cast<int>(lent_.size()); }
  ThreadCollider& operator[](int thread) const { return *lent_[static_cast<std::size_t>(thread)]; }

 private:
  std::vector<ThreadCollider*> lent_;
};

}  // namespace ode_parallel_sap
