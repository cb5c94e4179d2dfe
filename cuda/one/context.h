// What a finder keeps on its device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "cuda/device/device.h"
#include "cuda/device/graph.h"
#include "cuda/device/page_locks.h"
#include "cuda/one/lists.h"
#include "cuda/one/scene_plan.h"
#include "cuda/one/search.h"
#include "space/base/box_set.h"

namespace ode_parallel_sap {

// The stages of CudaStageTimes on the device, by the event that ends each.
enum DeviceStage {
  Start,
  Uploaded,
  Classified,
  Sorted,
  Packed,
  Searched,
  Scanned,
  Scattered,
  Listed,
  stages
};

// Everything that lives on the device. The streams come last, so that they are the first to go:
// they wait for what is under way, and nothing is freed while it is in use.
struct Context {
  explicit Context(int device) : processors(attributeOf(device, cudaDevAttrMultiProcessorCount)) {
    for (int i = 0; i < stages; ++i) stage_events.push_back(std::make_unique<Event>(Event::Time));
  }

  const int processors;
  DeviceBuffer<float> boxes;
  DeviceBuffer<FilterBits> bits;
  DeviceBuffer<BodyKey> bodies;
  DeviceBuffer<device::ScenePlan> plan;
  DeviceBuffer<std::uint32_t> keys[2], slots[2], starts;
  DeviceBuffer<std::uint64_t> long_keys[2];  // of clusters, and of long lists
  DeviceBuffer<std::uint8_t> flags;
  DeviceBuffer<char> sorted, tree;  // records
  DeviceBuffer<std::uint32_t> counts;
  DeviceBuffer<unsigned long long> begins;
  DeviceBuffer<std::uint32_t> long_slots;
  DeviceBuffer<unsigned long long> long_offsets;
  DeviceBuffer<std::uint32_t> rows;        // the first words of each list
  DeviceBuffer<device::Found> found;       // pairs beyond the rows
  DeviceBuffer<std::uint32_t> lists;       // with these in their places
  DeviceBuffer<device::Found> pairs;       // sorted, unless they go to the host at once
  DeviceBuffer<std::uint32_t> all_counts;  // of several devices that share a scene, summed up
  DeviceBuffer<char> scratch;

  PinnedBuffer<device::Counters> host_counters;
  PinnedBuffer<std::uint8_t> borderline;  // of sorted pairs (lists.h)

  PageLock boxes_lock, bits_lock, bodies_lock, pairs_lock;
  std::vector<std::unique_ptr<Event>> stage_events;
  Event piece_here, searched, result_here;
  CachedGraph graph;
  Stream compute, up, down;

  std::size_t hostBytes() const { return bytesOf(host_counters, borderline); }
  std::size_t deviceBytes() const {
    return bytesOf(boxes, bits, bodies, plan, keys, slots, starts, long_keys, flags, sorted, tree,
                   counts, begins, long_slots, long_offsets, rows, found, lists, pairs, all_counts,
                   scratch);
  }
  ScratchQueue queue() { return {{compute, processors}, scratch}; }
  // Places for pairs beyond the rows.
  std::size_t foundPlaces() const { return found.capacity() - device::overflow_places; }
};

}  // namespace ode_parallel_sap
