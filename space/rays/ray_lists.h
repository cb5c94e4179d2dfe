// Lists of a batch of rays, in storage that outlasts it.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/data/buffer.h"
#include "space/queries/query_tree.h"
#include "space/rays/ray_hits.h"

struct dxGeom;

namespace ode_parallel_sap {

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
