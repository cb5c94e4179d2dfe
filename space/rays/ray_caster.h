// Batches of rays against a space: dParallelSAPSpaceRays and dParallelSAPSpaceRayHits. Sees ODE's
// private headers.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/geoms/scene.h"
#include "space/queries/geom_tree.h"

namespace ode_parallel_sap {

// Where a geom stands: its slot, or that of the sub-space that it is in, and its place within.
struct RayTarget {
  Slot slot;
  std::uint32_t within;
};

struct RayFound {
  std::size_t ray;
  RayTarget target;
  std::uint32_t contact;  // of those that dCollide found
  dParallelSAPRayHit hit;
};

// Lists of hits, in storage that outlasts the batch.
struct RayLists {
  // A geom that a ray may hit, if its collider may only run elsewhere.
  struct Waiting {
    std::size_t ray;
    RayTarget target;
    dxGeom* geom;
    bool for_image;  // else for the calling thread
  };
  // Hits [first, first + count) of a thread's share.
  struct Block {
    std::size_t first;
    std::uint32_t count, thread;
  };
  struct alignas(64) Share {
    Buffer<RayFound> found;
    Buffer<RayFound> late;  // of what waited, in no order
    Buffer<Waiting> waiting;
    Buffer<Slot> slots;

    void clear() {
      found.resizeDiscarding(0);
      late.resizeDiscarding(0);
      waiting.resizeDiscarding(0);
    }
    std::size_t bytes() const { return bytesOf(found, late, waiting, slots); }
  };

  std::vector<Share> shares;  // by thread
  Buffer<Block> blocks;       // by ray
  Buffer<Waiting> waiting;
  Buffer<RayFound> late;
  Buffer<dParallelSAPRayHit> hits;

  std::size_t bytes() const { return bytesOf(shares, blocks, waiting, late, hits); }
};

struct RayRequest {
  const dParallelSAPRay* rays;
  std::size_t ray_size;  // of this version or of 0.1, without `ignore`
  std::size_t count;
  int flags;
  dParallelSAPRayHit* nearest;  // of each ray, or null:
  void* data;
  dParallelSAPRayCallback* all;
  std::size_t first = 0;  // of the rays that are cast

  dParallelSAPRay ray(std::size_t i) const {
    dParallelSAPRay ray;
    ray.ignore = nullptr;
    const char* const bytes = reinterpret_cast<const char*>(rays);
    std::memcpy(&ray, bytes + (first + i) * ray_size, ray_size);
    return ray;
  }
};

// Where rays come often enough, keeps a tree of the geoms whose colliders are known to find hits
// near their boxes only (ray_bounds.h), through which each ray goes in the order of distance, no
// farther than its nearest hit so far; and one of all others, of which each ray meets those that
// its own box overlaps, whatever it has hit. Where there are no trees, rays meet geom by geom.
//
// Rays go to a team's threads. What not every thread may collide waits until all are done: then
// for threads with an image of ODE, and at last for the calling thread (collider_threads.h). Hits
// are put in order, so that who found them does not matter.
class RayCaster {
 public:
  using Geoms = GeomTree::Geoms;
  struct Way {
    int threads;          // the most
    bool manual_cleanup;  // the threads leave no data in ODE
    bool trees = true;    // where they pay
    bool guest = false;   // it changes nothing but its lists
  };

  RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  void changed(std::size_t slot) {
    bounded_.changed(slot);
    others_.changed(slot);
  }
  void reset() {
    bounded_.reset();
    others_.reset();
  }
  // As of the trees.
  bool clean(const Geoms& geoms) { return bounded_.clean(geoms); }
  // Whether it gave back what it holds.
  bool noteFrame() {
    const bool bounded = bounded_.noteFrame(), others = others_.noteFrame();
    if (bounded || others) release();
    return bounded || others;
  }

  // Casts the rays and reports what they hit; where there is no memory for it, one by one. All
  // AABBs are up to date, and no other batch uses `lists`. Returns the number of rays that hit
  // something, or of all hits.
  std::size_t cast(const Scene& scene, const RayRequest& request, const Way& way, RayLists& lists);

  // Gives back all that is held.
  void release() {
    bounded_.release();
    others_.release();
  }
  std::size_t bytes() const { return bytesOf(bounded_, others_); }

 private:
  class Pass;

  bool prepare(const Geoms& geoms, const RayRequest& request, const Way& way);

  GeomTree bounded_, others_;
};

}  // namespace ode_parallel_sap
