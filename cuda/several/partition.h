// How several devices share a scene: it is cut along one axis. Plain host code.
#ifndef ODE_PARALLEL_SAP_CUDA_PARTITION_H
#define ODE_PARALLEL_SAP_CUDA_PARTITION_H

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cuda/one/place.h"
#include "cuda/several/tuning.h"
#include "space/data/box_set.h"

namespace ode_parallel_sap {

constexpr int most_shares = 16;  // fixed: as many as a machine has; a limit of arrays

// Share s takes the places from at[s - 1] on, below at[s].
struct Cuts {
  int axis = 0, shares = 1;
  Place at[most_shares - 1] = {};

  std::int32_t orderAt(int cut) const {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(at[cut] >> 32) ^ 0x80000000u);
  }
  std::uint32_t slotAt(int cut) const { return static_cast<std::uint32_t>(at[cut]); }

  int shareOf(Place place) const {
    int share = 0;
    for (int i = 0; i + 1 < shares; ++i) share += at[i] <= place;
    return share;
  }
};

// The shares that a box goes to. It begins in the first and is a guest in the others.
//
// A pair belongs to the share in which the later of its two boxes begins. Both boxes are there: the
// earlier one reaches up to the later one's lower bound, or they would not overlap. In all other
// shares that have both, both are guests. This holds for inverted boxes, whose lower bound counts
// as their end, and for infinite ones.
struct Span {
  int first, last;
};
inline Span spanOf(const Box& box, Slot slot, const Cuts& cuts) {
  const float low = box.lower[cuts.axis], high = box.upper[cuts.axis];
  const Place begin = placeOf(low, slot), end = placeOf(high, 0xffffffffu);
  return {cuts.shareOf(begin), cuts.shareOf(end > begin ? end : begin)};
}

// The boxes of one row of slots by the shares that they go to.
struct DealtRow {
  static constexpr std::size_t slots = 1024;       // fixed: deal_slots (shares.h), which says why
  std::uint32_t members[most_shares][slots / 32];  // bit i: the row's box i goes there
  std::uint16_t at[most_shares][slots];            // the same as places in the row, ascending
  std::size_t count[most_shares];
  void sort(const BoxSet& boxes, std::size_t row, const Cuts& cuts);

 private:
  void add(int share, std::size_t word, std::uint32_t bits);

  std::int32_t low_[slots], high_[slots];
};

// Chooses the cuts from frame to frame, so that all shares have the same work.
class Partition {
 public:
  // What one share came to.
  struct Work {
    std::size_t boxes = 0, pairs = 0;
    double cost() const {
      return device::pairs_of_a_box * static_cast<double>(boxes) + static_cast<double>(pairs);
    }
  };

  // Cuts into `shares` shares, up to most_shares. From a sample of the boxes along the axis where
  // the fewest of them are cut through; the parts of the axis that had much work for their number
  // of boxes in the last frame count for more.
  const Cuts& plan(const BoxSet& boxes, int shares);
  // The work of each share of the last plan.
  void learn(const Work* work);

 private:
  struct Sample {
    Box box;
    Slot slot;
  };
  void takeSample(const BoxSet& boxes);
  void order(int axis);
  void cut(int axis, int shares, bool weighted);
  std::size_t copies(const Cuts& cuts) const;
  int bestAxis(int shares);

  std::vector<Sample> sample_;
  std::vector<Place> places_;  // of the sample, ascending
  Cuts cuts_, last_cuts_;
  double density_[most_shares] = {};  // work by sampled box, between last_cuts_
  double mass_[most_shares] = {};     // sampled boxes that begin in each share of cuts_
  bool learnt_ = false;
};

}  // namespace ode_parallel_sap

#endif
