// What comes and goes only where several devices share a scene.
#ifndef ODE_PARALLEL_SAP_CUDA_SHARES_H
#define ODE_PARALLEL_SAP_CUDA_SHARES_H

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {
namespace device {

// fixed: slots whose boxes come in a row, a word of members a lane of a warp. The members are
// ascending.
constexpr std::size_t deal_slots = 1024;

// Bit i of `members`: the box of slot i has come. first_boxes[c]: where the members of slots
// [c * deal_slots, (c + 1) * deal_slots) begin among the boxes. slot_of[box] becomes its slot.
void numberBoxes(const std::uint32_t* members, const std::uint32_t* first_boxes, std::size_t slots,
                 std::uint32_t* slot_of, cudaStream_t stream);

// by_slot[slot_of[i]] = by_box[i].
void spread(const uint2* by_box, const std::uint32_t* slot_of, std::size_t boxes, uint2* by_slot,
            cudaStream_t stream);
void spread(const std::uint32_t* by_box, const std::uint32_t* slot_of, std::size_t boxes,
            std::uint32_t* by_slot, cudaStream_t stream);

}  // namespace device
}  // namespace ode_parallel_sap

#endif
