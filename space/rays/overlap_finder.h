// Batches of probes against a space: dParallelSAPSpaceOverlaps.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "space/base/buffer.h"
#include "space/contacts/narrow_phase.h"
#include "space/geoms/scene.h"
#include "space/rays/batch.h"

namespace ode_parallel_sap {

struct OverlapRequest {
  dParallelSAPProbe* probes;
  std::size_t count;
  int flags;  // of dCollide
  bool any;   // the first overlap of a probe will do
  void* data;
  dParallelSAPOverlapCallback* callback;  // or null
  std::size_t first = 0;                  // the number of probes[0]
  // The space's: whether probes in spaces may have swept bounds, and what makes a probe's AABB, on
  // the calling thread.
  bool swept = false;
  std::function<void(dxGeom*)> prepare = {};

  OverlapRequest only(std::size_t i) const {
    OverlapRequest one = *this;
    one.probes += i;
    one.count = 1;
    one.first += i;
    return one;
  }
};

// Lists of overlaps, in storage that outlasts the batch.
struct OverlapLists {
  struct alignas(64) Share {
    QueryLists query, nested;  // of the space, and of a sub-space
    Buffer<dParallelSAPPair> pairs;
    Buffer<Slot> slots;  // of the second geoms, or of the sub-spaces that they are in
    Buffer<dContactGeom> contacts;

    void resize(std::size_t size) {
      pairs.resize(size);
      slots.resize(size);
    }
    std::size_t bytes() const { return bytesOf(query, nested, pairs, slots, contacts); }
  };
  // Pairs [first, first + count) of a thread's share.
  struct Block {
    std::size_t first;
    std::uint32_t count;
    int thread;
  };

  std::vector<Share> shares;  // by thread
  Buffer<Block> blocks;       // by probe
  Share all;                  // in the order of the report
  NarrowPhase narrow_phase;

  std::size_t bytes() const { return bytesOf(shares, blocks, all, narrow_phase); }
};

// Finds the geoms that each probe's AABB overlaps, on all threads, collides these pairs by the
// narrow phase, and reports the contacts; where there is no memory for it, probe by probe. Probes
// whose AABB, or AABBTest, other threads may not ask for are left to the calling thread. All AABBs
// of the scene are up to date, and no other batch uses `lists`. Returns the sum of all `touched`.
std::size_t findOverlaps(const Scene& scene, GeomTree& tree, const PackRules& rules,
                         const OverlapRequest& request, const BatchWay& way, OverlapLists& lists,
                         NestedTrees nested);

}  // namespace ode_parallel_sap
