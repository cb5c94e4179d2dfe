// The last stages on the device: pairs found in no order become one sorted list a slot.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "cuda/device/device.h"
#include "cuda/one/scene_plan.h"
#include "cuda/one/search.h"

namespace ode_parallel_sap {
namespace device {

// begins[i] = counts[0] + ... + counts[i - 1] for i <= slots: where each list begins, the last one
// the number of pairs. counts[slots] is read.
void scanCounts(const std::uint32_t* counts, unsigned long long* begins, std::size_t slots,
                const ScratchQueue& queue);

// The slots of the long lists, and where the words of each begin among those of all.
struct LongSlots {
  std::uint32_t* slots;
  unsigned long long* offsets;
};
// Counts pairs and long lists, those longer than long_list, in `plan`, and notes these. Before
// scatter.
void summariseLists(const std::uint32_t* counts, const unsigned long long* begins,
                    std::size_t slots, ScenePlan* plan, const LongSlots& long_slots,
                    const KernelQueue& queue);

// Lists with a place for each pair: that of slot i begins at words[begins[i]]. left[i], at first
// the number of its pairs, is how many places from its first one on are not filled yet.
struct OpenLists {
  std::uint32_t* words;
  unsigned long long capacity;  // of words: nothing is done if the lists do not fit
  const unsigned long long* begins;
  std::size_t slots;
  std::uint32_t* left;
};
// Puts the pairs that are beyond the rows into their lists: at the last places of these, as many as
// they are, behind those for which there are rows (ListRows). Does nothing if they did not fit into
// `found`.
void scatterPairs(const FoundPairs& found, const ScenePlan* plan, const OpenLists& to,
                  const KernelQueue& queue);
// The same with `count` pairs, of which those of plan->counters.own are taken.
void scatterOwnPairs(const Found* found, std::size_t count, const ScenePlan* plan,
                     const OpenLists& to, const KernelQueue& queue);

// Pairs as the host has them (space/base/pair_list.h), in order, and for each segment_pairs of them
// whether one is borderline, which is 0 before. Both may be in the host's memory.
struct SortedPairs {
  Found* pairs;
  std::uint8_t* borderline;
};

// The rows of all parts of the scene. A row has as many words as its part has counted pairs of the
// slot, or as there is room for. Where there is one part only, whose
// counts are used up by scatter, the length of the list tells.
struct ListRows {
  struct OfPart {
    const std::uint32_t *words, *counts;
  };
  OfPart of[most_parts];
  std::uint32_t parts, length;
};

// The lists after scatter, and where they go as pairs when they are sorted. The first words of a
// list are in its slot's rows, part after part, say k of them; the others follow each other from
// words[begins[slot] + k] on.
struct Lists {
  ListRows rows;
  const std::uint32_t* words;
  unsigned long long capacity;  // of words, and of where they go
  const unsigned long long* begins;
  std::size_t slots;
  SortedPairs to;
};

// Sorts the lists but the long ones. Does nothing if they do not fit.
void sortLists(const Lists& lists, const KernelQueue& queue);

// Sorts the long ones of the lists. `long_lists`: of the plan's counters. `keys` grow as needed.
void sortLongLists(const Lists& lists, const LongSlots& long_slots, unsigned long long long_lists,
                   DeviceBuffer<std::uint64_t> (&keys)[2], const ScratchQueue& queue);

// Where several devices share a scene: which lists are a device's own.

// Pairs of each earlier slot, as each part has counted them.
struct PartCounts {
  const std::uint32_t* of[most_parts];
  std::uint32_t parts;
  std::size_t slots;
};

// sums[i] = what all parts have counted of slot i; sums[slots] = 0.
void addCounts(const PartCounts& counts, std::uint32_t* sums, const KernelQueue& queue);

// Where the lists of all parts begin (scanCounts), and how many pairs are in each.
struct AllLists {
  unsigned long long* begins;
  std::uint32_t* sums;
  std::size_t slots;
};

// Says in the plan which slots are the part's own (firstSlotOf), and makes of all lists these: the
// others become empty.
void keepOwnLists(const AllLists& lists, const Part& part, ScenePlan* plan,
                  const KernelQueue& queue);

}  // namespace device
}  // namespace ode_parallel_sap
