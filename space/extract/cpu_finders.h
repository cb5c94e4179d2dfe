// The methods that run on the CPU, each for boxes of floats and of doubles.
#ifndef ODE_PARALLEL_SAP_CPU_FINDERS_H
#define ODE_PARALLEL_SAP_CPU_FINDERS_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include "space/extract/paper/axis_lists.h"
#include "space/extract/paper/brute_force.h"
#include "space/extract/sweep.h"

namespace ode_parallel_sap {

class CPUFinders {
 public:
  // `axis_lists_bytes`: the most that the method AxisLists may take, 0: its own choice.
  PairFinder& of(int method, bool wide, std::uint64_t axis_lists_bytes) {
    if (method == dParallelSAPMethodBruteForce)
      return choose(brute_force_, wide_brute_force_, wide);
    if (method != dParallelSAPMethodAxisLists) return choose(sweep_, wide_sweep_, wide);
    axis_lists_.limit(axis_lists_bytes);
    wide_axis_lists_.limit(axis_lists_bytes);
    return choose(axis_lists_, wide_axis_lists_, wide);
  }

  template <class Real>
  Sweep<Real>& sweep();

  int findDense(const BoxSet& boxes, int threads, std::uint64_t places_of_a_pair, PairList& pairs) {
    return boxes.wide ? wide_brute_force_.findDense(boxes, threads, places_of_a_pair, pairs)
                      : brute_force_.findDense(boxes, threads, places_of_a_pair, pairs);
  }

  // Whether the last sweep made do with the cells of an earlier one.
  bool keptCells(bool wide) const { return wide ? wide_sweep_.keptCells() : sweep_.keptCells(); }

  std::size_t bytes() const {
    return bytesOf(brute_force_, wide_brute_force_, sweep_, wide_sweep_, axis_lists_,
                   wide_axis_lists_);
  }

 private:
  static PairFinder& choose(PairFinder& narrow, PairFinder& wide, bool is_wide) {
    return is_wide ? wide : narrow;
  }

  BruteForce<float> brute_force_;
  BruteForce<double> wide_brute_force_;
  Sweep<float> sweep_;
  Sweep<double> wide_sweep_;
  AxisLists<float> axis_lists_;
  AxisLists<double> wide_axis_lists_;
};

template <>
inline Sweep<float>& CPUFinders::sweep<float>() {
  return sweep_;
}
template <>
inline Sweep<double>& CPUFinders::sweep<double>() {
  return wide_sweep_;
}

}  // namespace ode_parallel_sap

#endif
