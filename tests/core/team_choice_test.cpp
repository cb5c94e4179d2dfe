// When a team of threads is tried, whatever the machine that this runs on is doing.
#include "space/frame/team_choice.h"

#include "support/catch.hpp"

using namespace ode_parallel_sap;

TEST_CASE("No team is tried while others take the calling thread's core", "[core]") {
  static ThreadUse use;
  static long preempted_a_frame;
  use = {};
  preempted_a_frame = 1;
  TeamChoice choice([] { return use; });
  const auto frameAlone = [&choice](double ms) {
    use.cpu_ms += ms;
    use.preempted += preempted_a_frame;
    choice.learn(1, 1000, ms, false);
  };
  for (int frame = 0; frame < 200; ++frame) {
    CHECK(choice.threads(4) == 1);
    frameAlone(1);
  }
  preempted_a_frame = 0;
  int frames = 0;
  while (choice.threads(4) == 1 && ++frames < 100) frameAlone(1);
  CHECK(frames <= 32);

  SECTION("A team that waits is left out, as one that could not be started") {
    choice.learn(GENERATE(1, 4), 1000, 9, true);
    CHECK(choice.threads(4) == 1);
  }
  SECTION("Long frames are worth a team on a busy host") {
    preempted_a_frame = 9;
    choice.learn(4, 1000, 9, true);
    for (int frame = 0; frame < 64; ++frame) frameAlone(40);
    CHECK(choice.threads(4) == 4);
  }
}
