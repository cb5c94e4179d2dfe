// Whatever a program does to a space and its geoms, it sees what it would see with ODE's spaces.
#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/twin_worlds.h"

using namespace sap_test;

namespace {

void editAndCheck(const Configuration& configuration, std::uint64_t seed, int geoms, int edits) {
  TwinWorlds twins(seed, configuration, geoms);
  std::string problem = twins.check();
  for (int i = 0; i < edits && problem.empty(); ++i) {
    twins.edit();
    if (i % 3 == 0) problem = twins.check();
  }
  INFO(configuration.name << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed << twins.history());
  REQUIRE(problem == "");
}

}  // namespace

TEST_CASE("Spaces show the twins' pairs, geoms and answers after any edits", "[edits]") {
  for (const Configuration& configuration : configurations()) {
    for (int round = 0; round < scaled(200); ++round)
      editAndCheck(configuration, seedOr(100, round), 12, 300);
    for (int round = 0; round < scaled(40); ++round)
      editAndCheck(configuration, seedOr(200, round), 120, 300);
  }
}
