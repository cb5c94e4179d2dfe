#include "configurations.h"

#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "ode_errors.h"

namespace sap_test {
namespace {

struct Named {
  int value;
  const char* name;
};

const Named kBackends[] = {{dParallelSAPBackendCPU, "cpu"}, {dParallelSAPBackendCUDA, "cuda"}};
const Named kMethods[] = {{dParallelSAPMethodAuto, "auto"},
                          {dParallelSAPMethodSweep, "sweep"},
                          {dParallelSAPMethodBruteForce, "brute force"},
                          {dParallelSAPMethodAxisLists, "axis lists"}};

std::string only() {
  const char* text = std::getenv("ODE_PARALLEL_SAP_TEST_ONLY");
  return text ? text : "";
}

bool isPrefix(const std::string& prefix, const std::string& text) {
  return text.rfind(prefix, 0) == 0;
}

void announce(const std::string& what) {
  std::fprintf(stderr, "SKIPPED: %s is not to be had here; no test covers it\n", what.c_str());
}

std::vector<Configuration> find() {
  std::vector<Configuration> found = {{dParallelSAPBackendAuto, dParallelSAPMethodAuto, "auto"}};
  const Space space;
  for (const Named& backend : kBackends) {
    // Not even looked for where it is not wanted: a device's driver starts threads.
    if (!isPrefix(backend.name, only()) && !isPrefix(only(), backend.name)) continue;
    if (!dParallelSAPSpaceSetBackend(space, backend.value)) {
      announce(std::string("back end ") + backend.name);
      continue;
    }
    for (const Named& method : kMethods) {
      const std::string name = std::string(backend.name) + ", " + method.name;
      if (!dParallelSAPSpaceSetMethod(space, method.value)) {
        announce("method " + name);
      } else if (isPrefix(only(), name)) {
        found.push_back({backend.value, method.value, name});
      }
    }
  }
  return found;
}

bool instructionSetIsThere() {
  const char* const asked_for = std::getenv("ODE_PARALLEL_SAP_SIMD");
  const Messages messages;
  const Space space;
  for (const std::string& message : messages.all()) {
    if (message.find("ODE_PARALLEL_SAP_SIMD") == std::string::npos) continue;
    if (message.find("not to be had") == std::string::npos) throw std::runtime_error(message);
    announce(std::string("instruction set ") + asked_for);
    return false;
  }
  return true;
}

}  // namespace

const std::vector<Configuration>& configurations() {
  static const std::vector<Configuration> all = find();
  return all;
}

bool anyConfigurationAskedFor() {
  return configurations().size() > 1 && instructionSetIsThere();
}

void configure(dSpaceID space, const Configuration& configuration) {
  if (!dParallelSAPSpaceSetBackend(space, configuration.backend) ||
      !dParallelSAPSpaceSetMethod(space, configuration.method)) {
    throw std::runtime_error(configuration.name + " was to be had and is no more");
  }
}

dParallelSAPStats statsOf(dSpaceID space) {
  dParallelSAPStats stats;
  dParallelSAPSpaceGetStats(space, &stats);
  return stats;
}

Space::Space() : id_(dParallelSAPSpaceCreate(nullptr)) {}

Space::Space(const Configuration& configuration) : Space() {
  configure(id_, configuration);
}

}  // namespace sap_test
