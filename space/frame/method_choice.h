// Which of the methods on the CPU is the fastest for a scene.
#pragma once

#include <cstddef>

#include "space/data/back_off.h"
#include "space/data/mechanisms.h"
#include "space/data/tuning.h"
#include "space/frame/tuning.h"

namespace ode_parallel_sap {

// Testing all pairs finds them in order. The sweep has to sort them, and to cut cells where it
// cannot keep those of the last frame: where boxes come, go or jump about. (Dense cubes, one
// thread: level at 200 slots where cells are kept, at 650 where they never are.)
class MethodChoice {
 public:
  // By the pairs of the last frame.
  static bool isDense(std::size_t slots, std::size_t pairs) {
    return mechanisms::tests_of_dense_scenes && pairs > slots * slots / places_of_a_pair;
  }
  // Whether to sweep a scene, or else to test all. A dense scene of more slots than most_tested is
  // told apart by testing all, which is given up where it is none.
  bool sweeps(std::size_t slots, std::size_t pairs) const {
    if (slots > most_tested || !mechanisms::tests_of_all) return true;
    return slots > least_swept && !isDense(slots, pairs) &&
           !(mechanisms::learned_method && back_off_.waits());
  }
  // What became of a sweep: it made do with the cells it had, or cut them anew.
  void learnOfSweep(bool kept_cells) {
    if (kept_cells) {
      back_off_.paid();
      if (cut_ > 0) --cut_;
    } else if ((cut_ += cut_frames - 1) > 2 * (cut_frames - 1)) {
      cut_ = 0;
      back_off_.failed();
    }
  }
  // A frame was found without it.
  void learnOfTests() { back_off_.pass(); }

 private:
  int cut_ = 0;
  BackOff back_off_{2 * cut_frames};
};

}  // namespace ode_parallel_sap
