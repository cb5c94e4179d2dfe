// Batches of rays against a space: dParallelSAPSpaceRays and dParallelSAPSpaceRayHits.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstring>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/rays/batch.h"

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
  struct alignas(64) Share {
    Buffer<RayFound> found;
    Buffer<RayFound> late;  // of what waited, in no order
    Buffer<Waiting> waiting;
    Buffer<Slot> slots[2];  // of the space, and of a sub-space

    void clear() {
      found.resizeDiscarding(0);
      late.resizeDiscarding(0);
      waiting.resizeDiscarding(0);
    }
    std::size_t bytes() const { return bytesOf(found, late, waiting, slots); }
  };

  std::vector<Share> shares;  // by thread
  Buffer<BatchBlock> blocks;  // by ray
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

// Casts the rays and reports what they hit; where there is no memory for it, one by one. All AABBs
// are up to date, and no other batch uses `lists`. Returns the number of rays that hit something,
// or of all hits.
//
// Where there is a tree, each ray goes in the order of distance through the geoms whose colliders
// find hits near their boxes only (ray_bounds.h), no farther than its nearest hit so far. Of all
// others it meets those that its own box overlaps. Without a tree it meets geom by geom. The same
// holds for sub-spaces with nested trees.
//
// What not every thread may collide waits until all rays are done: for threads with an image of
// ODE, and at last for the calling thread (collider_threads.h). Hits are sorted.
std::size_t castRays(const Scene& scene, GeomTree& tree, const RayRequest& request,
                     const BatchWay& way, RayLists& lists, NestedTrees nested);

}  // namespace ode_parallel_sap
