// The tuned constants of the paper's lists on devices.
#pragma once

namespace ode_parallel_sap {
namespace device {

// Pairs of an axis that a thread looks up: what a block found goes out together, from 16 kB of
// shared memory.
constexpr int pairs_a_thread = 8;

}  // namespace device
}  // namespace ode_parallel_sap
