// When a team of threads is tried, whatever the machine that this runs on is doing.
#include "space/frame/team_choice.h"

#include "support/catch.hpp"

using namespace ode_parallel_sap;

TEST_CASE("A team that waits or does not pay is left out, and tried again later", "[core]") {
  TeamChoice choice;
  const auto framesAlone = [&choice] {
    int frames = 0;
    while (choice.threads(4) == 1 && ++frames < 1000) choice.learn(1, 1000, 1, false);
    return frames;
  };
  CHECK(framesAlone() == 2);  // for comparison

  SECTION("A team that stalls, at once") {
    choice.learn(GENERATE(1, 4), 1000, 0.5, true);
    CHECK(choice.threads(4) == 1);
  }
  SECTION("A slow team after a few frames, each time for longer") {
    int before = 0;
    for (int trial = 0; trial < 4; ++trial) {
      int frames = 0;
      while (choice.threads(4) == 4 && ++frames < 100) choice.learn(4, 1000, 9, false);
      CHECK((frames > 1 && frames < 10));
      const int alone = framesAlone();
      CHECK(alone > before);
      before = alone;
    }
  }
  SECTION("A fast team never") {
    for (int frame = 0; frame < 100; ++frame) {
      CHECK(choice.threads(4) == 4);
      choice.learn(4, 1000, 0.5, false);
    }
  }
}
