#include "cuda/several/shares.h"
//
#include "cuda/one/primitives.cuh"

namespace ode_parallel_sap {
namespace device {

namespace {

constexpr int deal_words = deal_slots / 32;
static_assert(deal_words == 32, "one word of members a lane");

// One warp a row of deal_slots slots, one lane a word of its members; the last row may be short.
// Places of slot_of are below the number of boxes, as each member has one.
__global__ void __launch_bounds__(block_threads)
    numberKernel(const std::uint32_t* members, const std::uint32_t* first_boxes, std::size_t slots,
                 std::uint32_t* slot_of) {
  const std::size_t row = (blockIdx.x * std::size_t{block_threads} + threadIdx.x) / 32;
  const int lane = threadIdx.x % 32;
  if (row * deal_slots >= slots) return;
  const std::size_t word = row * deal_words + lane;
  const std::uint32_t own = word * 32 < slots ? members[word] : 0;
  std::uint32_t sum = __popc(own);
  for (int step = 1; step < 32; step *= 2) {
    const std::uint32_t below = __shfl_up_sync(all_lanes, sum, step);
    if (lane >= step) sum += below;
  }
  const std::uint32_t before = sum - __popc(own), first = first_boxes[row];
  // All lanes write the members of one word at a time, side by side.
  for (int from = 0; from < 32; ++from) {
    const std::uint32_t bits = __shfl_sync(all_lanes, own, from);
    const std::uint32_t place = first + __shfl_sync(all_lanes, before, from);
    if (bits >> lane & 1)
      slot_of[place + __popc(bits & ((1u << lane) - 1))] =
          static_cast<std::uint32_t>((row * deal_words + from) * 32 + lane);
  }
}

// One thread a box.
template <class Value>
__global__ void __launch_bounds__(block_threads)
    spreadKernel(const Value* by_box, const std::uint32_t* slot_of, std::size_t boxes,
                 Value* by_slot) {
  const std::size_t i = blockIdx.x * std::size_t{block_threads} + threadIdx.x;
  if (i < boxes) by_slot[slot_of[i]] = by_box[i];
}

}  // namespace

void numberBoxes(const std::uint32_t* members, const std::uint32_t* first_boxes, std::size_t slots,
                 std::uint32_t* slot_of, cudaStream_t stream) {
  const std::size_t rows = (slots + deal_slots - 1) / deal_slots;
  launch("number boxes", numberKernel, blocksForAll(rows * 32), block_threads, stream, members,
         first_boxes, slots, slot_of);
}

void spread(const uint2* by_box, const std::uint32_t* slot_of, std::size_t boxes, uint2* by_slot,
            cudaStream_t stream) {
  launch("spread bits", spreadKernel<uint2>, blocksForAll(boxes), block_threads, stream, by_box,
         slot_of, boxes, by_slot);
}

void spread(const std::uint32_t* by_box, const std::uint32_t* slot_of, std::size_t boxes,
            std::uint32_t* by_slot, cudaStream_t stream) {
  launch("spread bodies", spreadKernel<std::uint32_t>, blocksForAll(boxes), block_threads, stream,
         by_box, slot_of, boxes, by_slot);
}

}  // namespace device
}  // namespace ode_parallel_sap
