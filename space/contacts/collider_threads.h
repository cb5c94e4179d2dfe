// Which of ODE's colliders may run in several threads at once, and the threads for them.
#pragma once

#include <ode/ode.h>

#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

#include "space/base/parallel.h"

namespace ode_parallel_sap {

enum class ColliderUse {
  Light,          // any thread; about a microsecond, so many at a time
  Heavy,          // any thread; may take long, so few at a time
  OwnCollider,    // any thread with one of its own that can, see thread_colliders.h
  CallingThread,  // the calling thread, when no other collides
};

// How dCollide (a, b) may be called; neither is a space. Only reads the geoms.
ColliderUse colliderUse(dxGeom* a, dxGeom* b);

// Whether colliders of a mesh call the program back.
bool runsUserCode(dxGeom* mesh);
// A geom itself, or what a geom transform hands to that one's collider: null if it carries none.
dxGeom* carriedBy(dxGeom* geom);

// The program's dCollide. The preload library, which stands in front of it, sets this to the
// function behind itself before it makes a space.
inline std::atomic<decltype(&dCollide)> ode_collide{&dCollide};

// It, for a calling thread, while others collide, perhaps the same geoms. Threads take turns at
// geom transforms, and at meshes where their colliders share a cache or write to a mesh. Meshes
// with callbacks have no turns: the program's code is not to run while another thread waits for it.
int collideInTurn(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip);

// runChunks() with a part for each thread, by threads that have ODE's data, the calling thread
// apart: that one's is its own business. Without manual cleanup ODE frees it when the thread ends
// or ODE is closed. Where there is no memory for it the others do a thread's work.
template <class Work>
int runPartsWithData(Region& region, int threads, std::size_t count, std::size_t chunk,
                     bool manual_cleanup, Work&& work) {
  ChunkQueue queue(count, chunk, threads);
  const std::thread::id caller = std::this_thread::get_id();
  return runTeam(region, threads, [&](int thread, int) {
    const bool guest = std::this_thread::get_id() != caller;
    struct Cleanup {
      const bool due;
      ~Cleanup() {
        if (due) dCleanupODEAllDataForThread();
      }
    } const cleanup = {guest && manual_cleanup};
    if (guest && !dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll))) return;
    for (Range range; queue.next(range, thread);) work(range, thread);
  });
}

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
