// The last stages on the device: pairs found in no order become one sorted list a slot.
#ifndef ODE_PARALLEL_SAP_CUDA_LISTS_H
#define ODE_PARALLEL_SAP_CUDA_LISTS_H

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "cuda/device/device.h"
#include "cuda/one/scene_plan.h"
#include "cuda/one/search.h"

namespace ode_parallel_sap {
namespace device {

// ends[i] = counts[0] + ... + counts[i - 1] for i <= slots: where each list begins, the last one
// the number of pairs. counts[slots] is read.
void scanCounts(const std::uint32_t* counts, unsigned long long* ends, std::size_t slots,
                DeviceBuffer<char>& scratch, cudaStream_t stream);

// Before scatter: what the host needs, also in the plan's counters. Bit i of has_list: counts[i] is
// not 0; block_begins[b] = where the lists of block b of list_block slots begin, one more for the
// end; long_slots: the slots whose lists are longer than long_list.
void summariseLists(const std::uint32_t* counts, const unsigned long long* ends, std::size_t slots,
                    ScenePlan* plan, std::uint32_t* has_list, unsigned long long* block_begins,
                    std::uint32_t* long_slots, cudaStream_t stream);

// Puts the words of the pairs into their lists, in no order within a list. ends[i] becomes the end
// of list i. Does nothing if the pairs did not fit into `capacity`.
void scatterPairs(const Found* found, unsigned long long capacity, const ScenePlan* plan,
                  unsigned long long* ends, std::uint32_t* lists, int processors,
                  cudaStream_t stream);

// Words of the stretches that hold `words` words, headers included.
constexpr std::size_t stretchedSize(std::size_t words) {
  return (words + stretch_words - 1) / stretch_words * stretch_size;
}

// The same up to the last word: what there is to send.
constexpr std::size_t stretchedEnd(std::size_t words) {
  return words + (words + stretch_words - 1) / stretch_words * header_words;
}

// After scatter: sorts the lists of blocks [begin, end) but the long ones from `lists` into
// `stretches`.
void sortLists(const std::uint32_t* lists, const unsigned long long* ends, std::size_t slots,
               std::size_t begin, std::size_t end, std::uint32_t* stretches, cudaStream_t stream);

// What sorting long lists needs beside them; grows as needed.
struct LongListStore {
  DeviceBuffer<unsigned long long> begins, offsets;
  DeviceBuffer<std::uint64_t> keys[2];
  std::size_t bytes() const {
    return begins.bytes() + offsets.bytes() + keys[0].bytes() + keys[1].bytes();
  }
};

// After scatter: sorts the `count` long lists with `words` words in all.
void sortLongLists(const std::uint32_t* lists, const unsigned long long* ends, std::size_t slots,
                   const std::uint32_t* long_slots, std::uint32_t count, unsigned long long words,
                   LongListStore& store, std::uint32_t* stretches, DeviceBuffer<char>& scratch,
                   cudaStream_t stream);

}  // namespace device
}  // namespace ode_parallel_sap

#endif
