// What a program does with the pairs that are reported to it. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <cstdint>

#include "space/geom/ode_private.h"

namespace ode_parallel_sap {

// Counts, by the classes of two geoms and whether one of them has a body, how many pairs were
// reported and how many calls of dCollide there were with which flags. In the next report those
// kinds are precomputed of which the program collided enough, with the flags it used.
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
  // precomputed in this one: kinds of which at least this share of the pairs was collided.
  void beginReport(double least_share) {
    for (int kind = 0; kind < kinds; ++kind) take(kind, least_share);
  }
  // Nothing is precomputed in this report.
  void tellNothing() {
    for (int& flags : wanted_flags_) flags = 0;
  }
  void forget() { *this = CollideHabits(); }

  // The flags for which pairs of a kind are precomputed in this report; 0: they are not.
  int wantedFlags(int kind) const { return kind < 0 ? 0 : wanted_flags_[kind]; }
  bool tellsAny() const {
    for (const int flags : wanted_flags_)
      if (flags) return true;
    return false;
  }
  // Whether anything would be precomputed in the next report.
  bool wouldTellAny(double least_share) const {
    for (const Seen& seen : seen_)
      if (seen.isWorth(least_share)) return true;
    return false;
  }

  void notePair(int kind) {
    if (kind >= 0) ++seen_[kind].pairs;
  }
  // With CONTACTS_UNIMPORTANT some of ODE's colliders fail, so nobody is to call one in vain.
  void noteCall(int kind, int flags) {
    if (kind >= 0 && flags == (flags & 0xffff)) seen_[kind].noteCall(flags);
  }

 private:
  // Not planes: telling the contacts of a pair takes some 300 instructions and ODE's colliders with
  // a plane 50 to 300 (callgrind), so that no number of threads would make up for it.
  static constexpr int known_classes = dCylinderClass + 1;
  static constexpr int kinds = 2 * known_classes * known_classes;
  static_assert(dSphereClass == 0 && dCylinderClass == 3, "spheres to cylinders come first");

  struct Seen {
    std::uint32_t pairs = 0, calls = 0, other_calls = 0;
    int flags = 0, other_flags = 0;  // of `calls`; of the last of `other_calls`

    void noteCall(int called) {
      if (calls == 0 && other_calls == 0 && flags == 0) flags = called;
      if (called == flags) {
        ++calls;
      } else {
        ++other_calls;
        other_flags = called;
      }
    }
    bool isWorth(double least_share) const {
      return pairs > 0 && calls > other_calls &&
             static_cast<double>(calls - other_calls) >= least_share * static_cast<double>(pairs);
    }
  };

  static bool isKnown(int geom_class) { return geom_class >= 0 && geom_class < known_classes; }

  // Without pairs there is nothing to learn, and what was known stays.
  void take(int kind, double least_share) {
    Seen& seen = seen_[kind];
    if (seen.pairs) worth_[kind] = seen.isWorth(least_share);
    if (seen.other_calls > seen.calls) seen.flags = seen.other_flags;
    wanted_flags_[kind] = worth_[kind] ? seen.flags : 0;
    seen.pairs = seen.calls = seen.other_calls = 0;
  }

  Seen seen_[kinds];
  bool worth_[kinds] = {};
  int wanted_flags_[kinds] = {};
};

}  // namespace ode_parallel_sap
