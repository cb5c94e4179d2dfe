// The program's dCollide.
#pragma once

#include <ode/ode.h>

#include <atomic>

namespace ode_parallel_sap {

// The preload library, which stands in front of dCollide, sets it to the function behind itself
// before it makes a space.
inline std::atomic<decltype(&dCollide)> ode_collide{&dCollide};

}  // namespace ode_parallel_sap
