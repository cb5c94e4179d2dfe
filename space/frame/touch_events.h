// Which geoms of a space began and ceased to have contacts. Sees ODE's private headers.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/cache/pair_events.h"
#include "space/contacts/contact_pairs.h"
#include "space/contacts/narrow_phase.h"
#include "space/geoms/ode_private.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

// A touch of two geoms of the space itself belongs to their pair, with which PairEvents keeps it.
// The narrow phase lists the pairs whose touch changes. Other touches are told apart by their
// geoms, in a list in the order of the last frame: those of geoms in sub-spaces, which have numbers
// of the same pool of their own and the place of the pair of spaces, and those that outlived their
// pair, as another collide ended it.
class TouchEvents {
 public:
  // A frame begins, one with `contacts` or another one. The numbers of what ended are free.
  void beginFrame(PairEvents& pairs, bool contacts);
  // Compares what the narrow phase found with the touches of the last such frame. `pairs`: those of
  // this frame. False without memory: the touches stay for the next frame.
  bool update(const ContactPairs& contacts, const NarrowPhase& found, PairEvents& pairs,
              const PairRules& rules, int threads);
  // No more frames come.
  void end(PairEvents& pairs);

  const Buffer<PairEvents::Event>& begun() const { return begun_; }
  const Buffer<PairEvents::Event>& ended() const { return ended_; }
  bool lastHadNoContacts() const { return no_contacts_; }

  void release();
  std::size_t bytes() const {
    return bytesOf(begun_, ended_, changed_, again_, within_, next_within_, table_, left_);
  }

 private:
  using Number = PairEvents::Number;

  // A touch that is no pair's.
  struct Within {
    dxGeom *o1, *o2;
    std::size_t place;
    Number number;
    bool lasts;     // into the next frame, or since the last one
    bool outlives;  // its pair, if this began again
    bool isOf(const dxGeom* a, const dxGeom* b) const {
      return (o1 == a && o2 == b) || (o1 == b && o2 == a);
    }
  };

  void takeOutlived(PairEvents& pairs);
  void listTouches(const ContactPairs& contacts, const NarrowPhase& found, PairEvents& pairs);
  void listAgain(const Buffer<dxGeom*>& geoms, PairEvents& pairs);
  std::size_t match();
  std::uint32_t& entryOf(const dxGeom* o1, const dxGeom* o2);
  std::size_t findEnded(const Buffer<dxGeom*>& geoms, const PairRules& rules);
  void markPresent(dxGeom* geom);
  std::uintptr_t* findLeft(const dxGeom* geom);
  dxGeom* ifPresent(dxGeom* geom) { return *findLeft(geom) & present ? geom : nullptr; }
  void writeOwn(const Buffer<dxGeom*>& geoms, PairEvents& pairs, int threads);
  void writeWithin(PairNumbers& pool);
  static void giveBack(Buffer<Within>& touches, PairNumbers& pool, bool all);

  Buffer<PairEvents::Event> begun_, ended_;
  // Places of the space's own pairs that change, and of those whose touches outlived their pairs.
  Buffer<Number> changed_, again_;
  Buffer<Within> within_, next_within_;  // between two updates, next_within_ holds the last ones
  bool outlive_ = false;                 // any of within_
  Buffer<std::uint32_t> table_;          // of touches within, by their geoms
  int touching_ = 0;                     // the bit of this space
  // Addresses of geoms whose touches ended, ascending; with the bit if they are in the space.
  static constexpr std::uintptr_t present = 1;
  Buffer<std::uintptr_t> left_;
  bool no_contacts_ = false;
};

}  // namespace ode_parallel_sap
