#include "space/contacts/collider_threads.h"

namespace ode_parallel_sap {

ThreadColliders::ThreadColliders(int, std::size_t) {}

ThreadColliders::~ThreadColliders() = default;

}  // namespace ode_parallel_sap
