// Which of ODE's colliders may run in several threads at once, and the threads for them.
#pragma once

#include <ode/ode.h>

#include <atomic>
#include <thread>

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

// It, for a calling thread, while others may collide geoms of their own. Where
// the colliders of meshes share a cache, threads take turns at them. Meshes with callbacks do not:
// the program's code is not to run while another thread waits for it.
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

}  // namespace ode_parallel_sap
