// The filter stage: what boxes could not decide is decided on the geoms.
#pragma once

#include <vector>

#include "space/base/pair_list.h"
#include "space/geoms/geom_update.h"
#include "space/geoms/pair_gaps.h"

namespace ode_parallel_sap {

class PairFilter {
 public:
  // Drops the pairs that ODE's exact formula excludes, AABBTest apart, and those that the rules
  // leave out and `boxes` could not; the others stay in order, borderline_bit cleared. The geoms
  // behind all slots in `pairs` are clean and without NaN. Uses up to `threads` threads, and reads
  // no pairs but those of the borderline segments where these are all that there is to decide.
  void run(dxGeom* const* geoms, const UpdateFacts& facts, const PackRules& rules,
           const BoxSet& boxes, int threads, PairList& pairs);

  // Whether pairs that passed have to pass verify() as well, in every frame anew.
  static bool needsVerifying(const UpdateFacts& facts, const PackRules& rules) {
    return facts.user_classes || (rules.skip() && !rules.notified);
  }
  // What there is to verify besides that geoms are enabled.
  struct Verified {
    bool bits;          // which were not looked at for geoms at rest
    bool user_classes;  // their AABBTest functions, called on the calling thread
    UserClassSet tested_classes;
  };
  // Puts into `verified`, another list, the pairs to be reported.
  void verify(dxGeom* const* geoms, const Verified& what, int threads, const PairList& pairs,
              PairList& verified);
  std::size_t bytes() const {
    return bytesOf(pieces_to_test_, gaps_found_, gaps_, pieces_, pair_gaps_);
  }

 private:
  struct ExactTest;
  static Pair* verifyRun(dxGeom* const* geoms, const Verified& what, const Pair* begin,
                         const Pair* end, Pair* to);
  void testSegments(const ExactTest& test, int threads, PairList& pairs);

  std::vector<PairList::Segment> pieces_to_test_;
  std::vector<std::vector<PairList::Segment>> gaps_found_;  // one a thread
  std::vector<PairList::Segment> gaps_;
  std::vector<PairGaps::Piece> pieces_;
  PairGaps pair_gaps_;
};

}  // namespace ode_parallel_sap
