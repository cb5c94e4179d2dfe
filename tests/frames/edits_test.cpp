// Whatever a program does to a space and its geoms, it sees what it would see with ODE's spaces.
#include "fuzz/driver.h"
#include "support/tests.h"

using namespace sap_test;

namespace {

void editAndCheck(const Configuration& configuration, std::uint64_t seed, std::size_t most_geoms) {
  Decisions decisions(seed);
  Driver driver(decisions, most_geoms, &configuration);
  for (int i = 0; i < 200 && driver.problem().empty(); ++i) driver.step();
  if (driver.problem().empty()) driver.finish();
  INFO(configuration.name << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  REQUIRE(driver.problem() == "");
}

}  // namespace

TEST_CASE("Spaces show the oracle's pairs, geoms and answers after any edits", "[edits]") {
  for (const Configuration& configuration : configurations()) {
    for (int round = 0; round < scaled(400); ++round)
      editAndCheck(configuration, seedOr(100, round), 40);
    for (int round = 0; round < scaled(40); ++round)
      editAndCheck(configuration, seedOr(200, round), 250);
    for (int round = 0; round < scaled(10); ++round)
      editAndCheck(configuration, seedOr(300, round), 900);
  }
}
