// The filter stage: what boxes could not decide is decided on the geoms.
#pragma once

#include <vector>

#include "space/base/pair_list.h"
#include "space/geoms/geom_update.h"

namespace ode_parallel_sap {

class PairFilter {
 public:
  // Drops the pairs that ODE's exact formula excludes, AABBTest apart, and those that the rules
  // leave out and boxes could not, and with `planes` those that are clear of one; the
  // others stay in order, borderline_bit cleared. The geoms behind all slots in `pairs` are clean,
  // and packed by `update`.
  void dropExcluded(dxGeom* const* geoms, const GeomUpdate& update, const PackRules& rules,
                    bool planes, int threads, PairList& pairs);
  // Puts into `verified` those of the pairs that their geoms do not rule out in this frame.
  // `user_classes`: AABBTest functions may.
  static void verify(dxGeom* const* geoms, const PackRules& rules, bool user_classes, int threads,
                     const PairList& pairs, PairList& verified);
  std::size_t bytes() const { return bytesOf(pieces_to_test_, dropped_); }

 private:
  struct ExactTest;
  // What a thread puts aside, and where it is to go.
  struct Piece {
    Pair* to = nullptr;
    std::vector<Pair> head;
  };
  static Pair* verifyRun(dxGeom* const* geoms, const PackRules& rules, bool user_classes,
                         const Pair* begin, const Pair* end, Pair* to);
  bool testSegments(const ExactTest& test, int threads, PairList& pairs);
  void closeGaps(int threads, Buffer<Pair>& part, Buffer<std::uint32_t>& dropped);

  std::vector<PairList::Segment> pieces_to_test_;
  std::vector<Piece> pieces_;
  std::size_t block_ = 0;                       // pairs of a part
  std::vector<Buffer<std::uint32_t>> dropped_;  // in each block, a list a part
};

}  // namespace ode_parallel_sap
