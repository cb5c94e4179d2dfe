// The filter stage: what boxes could not decide is decided on the geoms.
#pragma once

#include <vector>

#include "space/base/pair_list.h"
#include "space/geoms/geom_update.h"
#include "space/geoms/plane_pairs.h"

namespace ode_parallel_sap {

class PairFilter {
 public:
  // Drops the pairs that ODE's exact formula excludes, AABBTest apart, and those that the rules
  // leave out and `boxes` could not; the others stay in order, borderline_bit cleared. The geoms
  // behind all slots in `pairs` are clean and without NaN.
  void dropExcluded(dxGeom* const* geoms, const UpdateFacts& facts, const PackRules& rules,
                    const BoxSet& boxes, int threads, PairList& pairs);

  // Pairs that follow from the candidates of a frame, in lists of their own.
  struct Selected {
    PairList pairs;
    PairList verified;      // those that planes are not in, if planes are found apart
    std::size_t added = 0;  // pairs of planes

    std::size_t bytes() const { return bytesOf(pairs, verified); }
  };
  // Whether pairs differ from candidates: geoms decide in each frame, or planes are found apart.
  bool mustSelect(const UpdateFacts& facts, const PackRules& rules) const {
    return needsVerifying(facts, rules) || planesApart(rules);
  }
  const PairList& select(dxGeom* const* geoms, const UpdateFacts& facts, const PackRules& rules,
                         const BoxSet& boxes, int threads, const PairList& candidates,
                         Selected& selected);
  // Pairs of planes are found apart, if the rules say so.
  PlanePairs& planes() { return planes_; }
  std::size_t bytes() const { return bytesOf(pieces_to_test_, dropped_, planes_); }

 private:
  static bool needsVerifying(const UpdateFacts& facts, const PackRules& rules) {
    return facts.user_classes || rules.verified();
  }
  bool planesApart(const PackRules& rules) const { return rules.cull_planes && planes_.any(); }
  void verify(dxGeom* const* geoms, const PackRules& rules, bool user_classes, int threads,
              const PairList& pairs, PairList& verified);
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
  PlanePairs planes_;
};

}  // namespace ode_parallel_sap
