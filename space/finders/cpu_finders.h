// The methods that run on the CPU, each for boxes of floats and of doubles.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include "space/pairs/sweep.h"
#include "space/paper/axis_lists.h"
#include "space/paper/brute_force.h"

namespace ode_parallel_sap {

template <class Real>
struct FindersOf {
  BruteForce<Real> brute_force;
  Sweep<Real> sweep;
  AxisLists<Real> axis_lists;

  PairFinder& of(int method) {
    if (method == dParallelSAPMethodBruteForce) return brute_force;
    if (method == dParallelSAPMethodAxisLists) return axis_lists;
    return sweep;
  }
  std::size_t bytes() const { return bytesOf(brute_force, sweep, axis_lists); }
};

struct CPUFinders {
  FindersOf<float> narrow;
  FindersOf<double> wide;

  // Calls use(finders) with those for boxes of floats or doubles.
  template <class Use>
  auto with(bool is_wide, Use use) {
    return is_wide ? use(wide) : use(narrow);
  }
  std::size_t bytes() const { return bytesOf(narrow, wide); }
};

}  // namespace ode_parallel_sap
