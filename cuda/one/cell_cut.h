// Where the sorted order is cut into cells: each place can tell for itself. For kernels and host.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/one/scene_plan.h"
#include "space/base/both_sides.h"

namespace ode_parallel_sap {
namespace device {

ODE_PARALLEL_SAP_BOTH_SIDES inline int highestDigit(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return 63 - __clzll(static_cast<long long>(bits));
#else
  return 63 - __builtin_clzll(bits);
#endif
}

// How many of the keys up to `last` share the digits from `shift` on with it; cell_size at most.
// The keys are sorted, so those that do are in a row. `room` keys can be read, `last` included.
template <class Key>
ODE_PARALLEL_SAP_BOTH_SIDES inline int alikeBefore(const Key* last, int room, int shift) {
  const Key wanted = *last >> shift;
  int low = 1, high = room < cell_size ? room : cell_size;  // low are alike for certain
  while (low < high) {
    const int middle = (low + high + 1) / 2;
    if (last[1 - middle] >> shift == wanted)
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

// The first place with the key of place i.
template <class Key>
ODE_PARALLEL_SAP_BOTH_SIDES inline std::size_t firstAlike(const Key* keys, std::size_t i) {
  const Key own = keys[i];
  std::size_t low = 0, high = i;
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if (keys[middle] < own)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

struct CellCut {
  bool begins;   // a cell begins there
  bool cluster;  // and so many boxes with its key lie behind that they are a cluster
};

// Place i of `count` sorted keys, the class in the top class_digits.
template <class Key>
ODE_PARALLEL_SAP_BOTH_SIDES inline CellCut cellCutAt(const Key* keys, std::size_t count,
                                                     std::size_t i) {
  constexpr int class_shift = sizeof(Key) * 8 - class_digits;
  if (i == 0) return {true, false};
  const Key* const at = keys + i;
  const Key differ = at[0] ^ at[-1];
  if (differ >> class_shift) return {true, false};
  const std::size_t ahead = count - i, most = cell_size;
  const int room_ahead = static_cast<int>(ahead < most ? ahead : most);
  const int room_behind = static_cast<int>(i < most ? i : most);
  // The block of space that holds both is cut here unless it fits into a cell as a whole. The keys
  // of one class share the class's digits, so no block reaches across.
  const int shift = differ ? highestDigit(differ) + 1 : 0;
  const int beyond = cell_size - alikeBefore(at - 1, room_behind, shift);
  if (beyond >= room_ahead || at[beyond] >> shift != at[0] >> shift) return {false, false};
  if (differ) return {true, false};
  const std::size_t before = i - firstAlike(keys, i);
  return {before % cell_size == 0, before == cluster_size};
}

}  // namespace device
}  // namespace ode_parallel_sap
