// The middle stages on the device: boxes sorted along the curve, cut into cells, put into a tree.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "cuda/device/device.h"
#include "cuda/one/scene_plan.h"

namespace ode_parallel_sap {
namespace device {

// Where the levels of a tree over up to `most` cells begin in one array of records. Level 0 are the
// cells' bounds; record i of a level bounds records fan_out i to fan_out i + fan_out - 1 of the
// level below. How many there are is known on the device only: the tree ends at the first level
// of at most fan_out records.
struct TreeLayout {
  std::size_t begin[most_levels];
  std::size_t records;  // of all levels
  explicit TreeLayout(std::size_t most);
};

// Keys, and slots that belong to them.
template <class Key>
struct KeyedSlots {
  Key* keys;
  std::uint32_t* slots;
};

// Sorts `count` slots by their keys, of 32 or 64 bits, from one place to another; stable.
template <class Key>
void sortByKey(const KeyedSlots<Key>& from, const KeyedSlots<Key>& to, std::size_t count,
               const ScratchQueue& queue);

// Cuts the order where digits of the keys change until no cell has more than cell_size boxes, and
// within clusters of equal keys. starts[0..plan->cells) become the cells' first places. `flags` has
// room for `count`. Says in the plan whether a cluster is larger than a search can bear.
template <class Key>
void cutCells(const Key* keys, std::size_t count, ScenePlan* plan, std::uint8_t* flags,
              std::uint32_t* starts, const ScratchQueue& queue);

// What the search reads.
struct CellStore {
  void* sorted;       // memory for a record a box
  void* tree;         // memory for layout.records
  std::size_t boxes;  // of which there are cells
  TreeLayout layout;
};

// Gathers the boxes in their order, and builds the tree. A record's low.w is the box's slot.
void packCells(const OrderedBoxes& boxes, const std::uint32_t* starts, const ScenePlan* plan,
               const CellStore& to, const KernelQueue& queue);

}  // namespace device
}  // namespace ode_parallel_sap
