// Hits of a batch of rays, their order, and lists of them in storage that outlasts the batch.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/queries/query_tree.h"

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

// The distance of hits decides, then where the geoms stand. NaN is farther than all else.
inline bool isNearer(const RayFound& a, const RayFound& b) {
  const dReal p = a.hit.distance, q = b.hit.distance;
  if (p < q || q < p) return p < q;
  if ((p != p) != (q != q)) return q != q;
  if (a.target.slot != b.target.slot) return a.target.slot < b.target.slot;
  if (a.target.within != b.target.within) return a.target.within < b.target.within;
  return a.contact < b.contact;
}

inline bool isBefore(const RayFound& a, const RayFound& b) {
  return a.ray != b.ray ? a.ray < b.ray : isNearer(a, b);
}

inline dParallelSAPRayHit hitOf(dGeomID geom, const dContactGeom& contact) {
  dParallelSAPRayHit hit = {};
  hit.geom = geom;
  hit.distance = contact.depth;
  for (int axis = 0; axis < 3; ++axis) {
    hit.pos[axis] = contact.pos[axis];
    hit.normal[axis] = contact.normal[axis];
  }
  hit.side = contact.side2;
  return hit;
}

struct RayLists {
  // A geom that a ray may hit, if its collider may only run elsewhere.
  struct Waiting {
    std::size_t ray;
    RayTarget target;
    dxGeom* geom;
  };
  // Hits [first, first + count) of a thread's share.
  struct Block {
    std::size_t first;
    std::uint32_t count, thread;
  };
  struct alignas(64) Share {
    Buffer<RayFound> found;
    Buffer<RayFound> late;  // of what waited, in no order
    Buffer<Waiting> image, calling_thread;
    Buffer<Slot> slots;

    void clear(std::size_t slots_of_space) {
      found.resizeDiscarding(0);
      late.resizeDiscarding(0);
      image.resizeDiscarding(0);
      calling_thread.resizeDiscarding(0);
      slots.resizeDiscarding(slots_of_space + QueryTree<float>::spare);
    }
    std::size_t bytes() const { return bytesOf(found, late, image, calling_thread, slots); }
  };

  std::vector<Share> shares;  // by thread
  Buffer<Block> blocks;       // by ray, where all hits are asked for
  Buffer<Waiting> waiting;
  Buffer<RayFound> late;
  Buffer<dParallelSAPRayHit> hits;

  std::size_t bytes() const { return bytesOf(shares, blocks, waiting, late, hits); }
};

}  // namespace ode_parallel_sap
