// Numbers that a file compiled with -ffast-math must not name itself.
#pragma once

#include <ode/ode.h>

namespace sap_test {

extern const dReal kInfinity;
extern const dReal kNaN;

}  // namespace sap_test
