// The environment that stands in where a program sets nothing.
#pragma once

#include <initializer_list>
#include <string>

#include "space/frame/policy.h"

namespace ode_parallel_sap {

// Passes a text to dMessage, once in a process: each space reads the environment.
void complainOnce(const std::string& text);
// The number of the name that a variable has, `value` if it is not set. Complains of others.
int nameFromEnvironment(const char* variable, std::initializer_list<const char*> names, int value);
constexpr std::initializer_list<const char*> notified_modes = {"0", "1", "check"};

// The defaults as changed by ODE_PARALLEL_SAP_*, of which ODE_PARALLEL_SAP_SIMD takes effect at
// once. Complaints, also of unknown names, go to dMessage.
Settings settingsFromEnvironment();

}  // namespace ode_parallel_sap
