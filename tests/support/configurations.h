// Every back end and method that this build and this machine have.
#pragma once

#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <string>
#include <vector>

#include "bounds.h"

namespace sap_test {

struct Configuration {
  int backend;  // dParallelSAPBackend...
  int method;   // dParallelSAPMethod...
  std::string name;
};
inline const Configuration on_cpu = {dParallelSAPBackendCPU, dParallelSAPMethodAuto, "auto"};

// Each pair of a back end and a method to which the library answers 1: "cpu, sweep" and so on, and
// "auto" for neither set. What it answers 0 to is named once on stderr. A new back end or method
// takes part in all tests as soon as it is listed in configurations.cpp.
//
// ODE_PARALLEL_SAP_TEST_ONLY keeps to the names that begin with its value, and to "auto".
const std::vector<Configuration>& configurations();

// Whether ODE_PARALLEL_SAP_TEST_ONLY asks for something that is to be had, or for nothing, and so
// does ODE_PARALLEL_SAP_SIMD. Throws where the latter asks for what the library does not
// understand.
bool anyConfigurationAskedFor();

void configure(dSpaceID space, const Configuration& configuration);

dParallelSAPStats statsOf(dSpaceID space);

// A dParallelSAPSpace that is destroyed at the end of its scope.
class Space {
 public:
  Space();
  explicit Space(const Configuration& configuration);
  ~Space() { dSpaceDestroy(id_); }
  Space(const Space&) = delete;
  Space& operator=(const Space&) = delete;

  operator dSpaceID() const { return id_; }
  dGeomID geom() const { return reinterpret_cast<dGeomID>(id_); }

 private:
  dSpaceID id_;
};

}  // namespace sap_test
