// What batches of rays and of probes have in common.
#pragma once

#include <cstddef>
#include <new>
#include <optional>

#include "space/geoms/scene.h"
#include "space/queries/geom_tree.h"

namespace ode_parallel_sap {

struct BatchWay {
  int threads;          // the most
  bool manual_cleanup;  // the threads leave no data in ODE
  bool guest;           // it changes nothing but its lists
  QueryFilter filter;
};

// Calls find(tree, request, threads), which leaves in `lists` what it found, by the tree where that
// pays, or null, and then report(request), whose callbacks may leave by longjmp. Where there is no
// memory for it, one query after the other. Returns the sum of what report() returns.
template <class Request, class Lists, class Find, class Report>
std::size_t runBatch(const Scene& scene, GeomTree& tree, const Request& request,
                     const BatchWay& way, Lists& lists, NestedTrees& nested, Find find,
                     Report report) {
  bool found = false;
  try {
    std::optional<GeomTree::Reader> reader;
    if (way.guest) reader.emplace(tree);
    const bool by_tree =
        reader ? reader->mayRead() : tree.bringUpToDate(scene.slots, way.threads, request.count);
    find(by_tree ? &tree : nullptr, request, way.threads);
    found = true;
  } catch (const std::bad_alloc&) {
    if (!way.guest) tree.release();
  }
  NestedTrees().swap(nested);
  if (found) return report(request);
  std::size_t all = 0;
  for (std::size_t i = 0; i < request.count; ++i) {
    lists = Lists();
    const Request one = request.only(i);
    try {
      find(nullptr, one, 1);
    } catch (const std::bad_alloc&) {
      if (way.filter.isSet()) throw;  // perhaps the filter does
      dDebug(0, "parallel SAP space: no memory for one query of a batch");
      continue;
    }
    all += report(one);
  }
  lists = Lists();
  return all;
}

}  // namespace ode_parallel_sap
