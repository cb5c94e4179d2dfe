// Which geoms of a space began and ceased to touch: whose contacts were reported. Sees ODE's
// private headers.
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

// Touches of two geoms of the space itself are some of its pairs: PairEvents compares them, with
// numbers and places of the pairs. Touches of geoms in sub-spaces are found by a table of their
// addresses. They have numbers of the same pool of their own, and the place of the pair of spaces.
class TouchEvents {
 public:
  // A frame begins, one with `contacts` or another one. The numbers of what ended are free.
  void beginFrame(PairEvents& pairs, bool contacts);
  // Compares what the narrow phase found with the touches of the last such frame. `pairs`: those of
  // this frame. False without memory: the touches stay for the next frame.
  bool update(const ContactPairs& contacts, const NarrowPhase& found, PairEvents& pairs,
              const PackRules& rules, int threads);
  // No more frames come.
  void end(PairEvents& pairs);

  void removeGeom(Slot slot) { direct_.removeGeom(slot); }
  void closeSlots(const Buffer<dxGeom*>& geoms) { direct_.closeSlots(geoms); }
  // The geom leaves a space: at its address another one may come.
  static void forget(dxGeom* geom) { geom->gflags &= ~(nested_spaces * lowest_touching); }

  const Buffer<PairEvents::Event>& begun() const { return direct_.begun(); }
  const Buffer<PairEvents::Event>& ended() const { return direct_.ended(); }
  // Whether the last frame had no contacts.
  bool lastHadNoContacts() const { return no_contacts_; }

  void release();
  std::size_t bytes() const {
    return bytesOf(direct_, pairs_, numbers_, places_, within_, next_within_, table_, left_,
                   present_);
  }

 private:
  // fixed: in gflags, where ODE uses the lower bits. Geoms in sub-spaces that a space has seen to
  // touch have its bit: one of four, so that spaces in spaces have their own.
  static constexpr int lowest_touching = 1 << 20, nested_spaces = 15;

  // A touch with a geom in a sub-space.
  struct Within {
    dxGeom *o1, *o2;
    std::size_t place;
    PairEvents::Number number;
    bool lasts;  // into the next frame, or since the last one
  };

  void list(const ContactPairs& contacts, const NarrowPhase& found, const PairEvents& pairs);
  void chooseBit(const Buffer<dxGeom*>& geoms);
  void match();
  std::uint32_t& entryOf(const dxGeom* o1, const dxGeom* o2);
  void findPresent(const Buffer<dxGeom*>& geoms);
  void notePresent(dxGeom* geom);
  void writeWithin(PairNumbers& pool);
  static void giveBack(Buffer<Within>& touches, PairNumbers& pool, bool all);

  PairEvents direct_;
  PairList pairs_;  // that touch, with their numbers and places
  Buffer<PairEvents::Number> numbers_;
  Buffer<std::size_t> places_;

  Buffer<Within> within_, next_within_;  // between two updates, next_within_ holds the last ones
  Buffer<std::uint32_t> table_;          // of touches, by their geoms
  int touching_ = lowest_touching;       // the bit of this space
  std::size_t begun_ = 0, ended_ = 0;    // of next_within_ and within_, in an update
  Buffer<dxGeom*> left_, present_;       // geoms of touches that ended; those that are still there
  bool no_contacts_ = false;
};

}  // namespace ode_parallel_sap
