// Batches of probes against a space: dParallelSAPSpaceOverlaps.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <functional>
#include <vector>

#include "space/base/buffer.h"
#include "space/contacts/narrow_phase.h"
#include "space/rays/batch.h"

namespace ode_parallel_sap {

struct OverlapRequest {
  dParallelSAPProbe* probes;
  std::size_t count;
  int flags;  // of dCollide
  bool any;   // the first overlap of a probe will do
  void* data;
  dParallelSAPOverlapCallback* callback;  // or null
  std::size_t first = 0;                  // of the probes that are asked for
  // The space's: whether probes in spaces may have swept bounds, and what makes a probe's AABB, on
  // the calling thread.
  bool swept = false;
  std::function<void(dxGeom*)> prepare = {};

  dParallelSAPProbe& probe(std::size_t i) const { return probes[first + i]; }
};

// Lists of overlaps, in storage that outlasts the batch.
struct OverlapLists {
  struct Found {
    dParallelSAPPair pair;
    Slot slot;  // of the second geom, or of the sub-space that it is in
  };
  struct alignas(64) Share {
    QueryLists query, nested;  // of the space, and of a sub-space
    Buffer<Found> found;
    Buffer<dContactGeom> contacts;

    void clear() { found.resizeDiscarding(0); }
    std::size_t bytes() const { return bytesOf(query, nested, found, contacts); }
  };

  std::vector<Share> shares;       // by thread
  Buffer<BatchBlock> blocks;       // by probe
  Buffer<dParallelSAPPair> pairs;  // in the order of the report
  NarrowPhase narrow_phase;

  std::size_t bytes() const { return bytesOf(shares, blocks, pairs, narrow_phase); }
};

// Finds the geoms that each probe's AABB overlaps, on all threads, collides these pairs by the
// narrow phase, and reports the contacts; where there is no memory for it, probe by probe. Probes
// whose AABB, or AABBTest, other threads may not ask for are left to the calling thread. All AABBs
// of the scene are up to date, and no other batch uses `lists`. Returns the sum of all `touched`.
std::size_t findOverlaps(const Scene& scene, GeomTree& tree, const OverlapRequest& request,
                         const BatchWay& way, OverlapLists& lists, NestedTrees nested);

}  // namespace ode_parallel_sap
