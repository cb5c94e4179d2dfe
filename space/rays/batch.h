// What batches of rays and of probes have in common.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>

#include "space/base/tuning.h"
#include "space/contacts/collider_threads.h"
#include "space/geoms/scene.h"
#include "space/queries/geom_tree.h"

namespace ode_parallel_sap {

struct BatchWay {
  int threads;          // the most
  bool manual_cleanup;  // the threads leave no data in ODE
  bool guest;           // it changes nothing but its lists
  QueryFilter filter;
  PairRules rules;
};

// What a query found: entries [first, first + count) of a thread's share.
struct BatchBlock {
  std::size_t first;
  std::uint32_t count;
  int thread;
};

// A batch on its way.
template <class Request, class Lists>
struct BatchPass {
  const GeomTree* const tree;  // up to date, or null
  const NestedTrees& nested;
  const Scene& scene;
  const Request& request;
  const BatchWay& way;
  Lists& lists;
  const FloatingPointMode mode = currentMode();  // the program's

  int team() const { return teamFor(request.count, grains::cast_rays, way.threads); }

  // Calls find(i, thread, alone) for all queries, on a team, whose shares are empty at first.
  template <class Find>
  void findAll(Region& region, Find find) const {
    const int threads = team();
    if (lists.shares.size() < static_cast<std::size_t>(threads)) lists.shares.resize(threads);
    for (auto& share : lists.shares) share.clear();
    lists.blocks.resizeDiscarding(request.count);
    const std::size_t chunk = chunkOf(request.count, grains::cast_rays.work / 4, threads);
    runPartsWithData(region, threads, request.count, chunk, way.manual_cleanup,
                     [&](const Range& range, int thread) {
                       for (std::size_t i = range.begin; i < range.end; ++i)
                         find(i, thread, /*alone=*/threads == 1);
                     });
  }

  // Whether the program's filter does.
  bool rejects(std::size_t i, dxGeom* geom) const {
    if (!way.filter.function) return false;
    const ScopedMode programs(mode);
    return way.filter.function(way.filter.data, request.first + i, geom) == 0;
  }
};

// Runs a Pass, by the tree where that pays, which leaves in `lists` what it found, and then its
// report(), whose callbacks may leave by longjmp. Where there is no memory for it, one query after
// the other. Returns the sum of what report() returns.
template <class Pass, class Request, class Lists>
std::size_t runBatch(const Scene& scene, GeomTree& tree, const Request& request,
                     const BatchWay& way, Lists& lists, NestedTrees nested) {
  bool found = false;
  try {
    std::optional<GeomTree::Reader> reader;
    if (way.guest) reader.emplace(tree);
    const bool by_tree =
        reader ? reader->mayRead() : tree.bringUpToDate(scene.slots, way.threads, request.count);
    Pass{{by_tree ? &tree : nullptr, nested, scene, request, way, lists}}.run();
    found = true;
  } catch (const std::bad_alloc&) {
    if (!way.guest) tree.release();
  }
  NestedTrees().swap(nested);
  if (found) return Pass::report(scene, request, lists);
  std::size_t all = 0;
  Request one = request;
  BatchWay alone = way;
  alone.threads = 1;
  for (one.count = 1; one.first < request.count; ++one.first) {
    lists = Lists();
    try {
      Pass{{nullptr, nested, scene, one, alone, lists}}.run();
    } catch (const std::bad_alloc&) {
      if (way.filter.function) throw;  // perhaps the filter does
      dDebug(0, "parallel SAP space: no memory for one query of a batch");
      continue;
    }
    all += Pass::report(scene, one, lists);
  }
  lists = Lists();
  return all;
}

}  // namespace ode_parallel_sap
