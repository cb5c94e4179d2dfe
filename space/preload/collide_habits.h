// What a program does with the pairs that are reported to it. Sees ODE's private headers.
#pragma once

#include <cstdint>

#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// Counts, by the classes of two geoms and whether one of them has a body, how many pairs were
// reported and how many calls of dCollide there were with the flags of most. In the next report
// those kinds are precomputed of which the program collided enough, with these flags.
class CollideHabits {
 public:
  // The kind of a pair, or -1 where nothing is precomputed. All that dCollide reads of these
  // classes lies in the geoms and their bodies, and whoever changes it makes the geom dirty.
  // (Vertices, heights and the flags of rays change without a trace, other classes are the
  // program's.) Geoms of one body are not collided while they are that.
  static int kindOf(const dxGeom* o1, const dxGeom* o2) {
    if (!o1 || !o2 || !isKnown(o1->type) || !isKnown(o2->type)) return -1;
    const bool bodies = o1->body || o2->body;
    if (bodies && o1->body == o2->body) return -1;
    return 2 * (o1->type * known_classes + o2->type) + bodies;
  }

  // From now on what is seen counts for the next report, and what was seen decides what is
  // precomputed in this one: kinds of which at least this share of the pairs was collided. Of kinds
  // without pairs nothing is learnt.
  void beginReport(double least_share) {
    for (Kind& kind : kinds_) {
      if (kind.pairs) kind.wanted_flags = kind.isWorth(least_share) ? kind.flags : 0;
      kind.pairs = kind.votes = 0;
    }
  }
  void forget() { *this = CollideHabits(); }

  // The flags for which pairs of a kind are precomputed in this report; 0: they are not.
  int wantedFlags(int kind) const { return kind < 0 ? 0 : kinds_[kind].wanted_flags; }
  bool wantsAny() const {
    for (const Kind& kind : kinds_)
      if (kind.wanted_flags) return true;
    return false;
  }
  // Whether anything would be precomputed in the next report.
  bool wouldWantAny(double least_share) const {
    for (const Kind& kind : kinds_)
      if (kind.isWorth(least_share)) return true;
    return false;
  }

  void notePair(int kind) {
    if (kind >= 0) ++kinds_[kind].pairs;
  }
  // With CONTACTS_UNIMPORTANT some of ODE's colliders fail, so nobody is to call one in vain.
  void noteCall(int kind, int flags) {
    if (kind >= 0 && flags == (flags & 0xffff)) kinds_[kind].vote(flags);
  }

 private:
  // Not planes: handing out the contacts of a pair takes some 300 instructions and ODE's colliders
  // with a plane 50 to 300 (callgrind), so that no number of threads would make up for it.
  static constexpr int known_classes = dCylinderClass + 1;
  static_assert(dSphereClass == 0 && dCylinderClass == 3, "spheres to cylinders come first");

  struct Kind {
    std::uint32_t pairs = 0, votes = 0;  // calls with `flags` less those with others
    int flags = 0, wanted_flags = 0;

    void vote(int called) {
      if (votes == 0) flags = called;
      votes += called == flags ? 1u : ~0u;
    }
    bool isWorth(double least_share) const {
      return pairs > 0 && votes > 0 &&
             static_cast<double>(votes) >= least_share * static_cast<double>(pairs);
    }
  };

  static bool isKnown(int geom_class) { return geom_class >= 0 && geom_class < known_classes; }

  Kind kinds_[2 * known_classes * known_classes];
};

}  // namespace ode_parallel_sap
