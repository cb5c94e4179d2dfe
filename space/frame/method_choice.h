// Which of the methods on the CPU is the fastest for a scene.
#ifndef ODE_PARALLEL_SAP_METHOD_CHOICE_H
#define ODE_PARALLEL_SAP_METHOD_CHOICE_H

#include <cstddef>

#include "space/frame/pause.h"

namespace ode_parallel_sap {

// Testing all pairs finds them in order. The sweep has to sort them, and to cut cells where it
// cannot keep those of the last frame: where boxes come, go or jump about. (Dense cubes, one
// thread: level at 200 slots where cells are kept, at 650 where they never are.)
class MethodChoice {
 public:
  // Whether to sweep a scene of which the last frame had so many pairs, or else to test all.
  bool sweeps(std::size_t slots, std::size_t pairs) {
    if (slots <= least_slots || isCrowd(slots, pairs)) return false;
    return slots > most_slots || !pause_.skipsTurn();
  }
  // Where so many of all pairs overlap that testing all is faster whatever their number: from 300
  // to 10,000 boxes from every 40th to 50th place in the table of all with all on.
  static bool isCrowd(std::size_t slots, std::size_t pairs) {
    return pairs > slots * slots / places_of_a_pair;
  }
  static constexpr std::size_t places_of_a_pair = 45;
  // What became of a sweep: it made do with the cells it had, or cut them anew.
  void learn(bool kept_cells) {
    if (kept_cells) {
      pause_.reset();
      if (cut_ > 0) --cut_;
    } else if ((cut_ += cut_weight) > most_cut) {
      cut_ = 0;
      pause_.lengthen(4, longest_pause);
    }
  }

 private:
  static constexpr std::size_t least_slots = 200, most_slots = 650;
  // Cells may be cut in every fourth frame.
  static constexpr int cut_weight = 3, most_cut = 6;
  static constexpr int longest_pause = 256;

  int cut_ = 0;
  Pause pause_;
};

}  // namespace ode_parallel_sap

#endif
