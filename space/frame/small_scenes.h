// Scenes so small that they need no boxes. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/tuning.h"
#include "space/cache/pair_events.h"
#include "space/frame/complaints.h"
#include "space/frame/statistics.h"
#include "space/frame/without_memory.h"
#include "space/geoms/geom_tests.h"
#include "space/geoms/pack_rules.h"
#include "space/geoms/pair_watcher.h"
#include "space/geoms/scene.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// Places in a list of geoms; read as they are written, in one word.
struct PlacePair {
  std::uint16_t places;
  unsigned earlier() const { return places >> 8; }
  unsigned later() const { return places & 0xff; }
};

// Where the pairs of a small scene are put that are not remembered: not on the stack, which may be
// small, and deep with calls within callbacks.
struct SmallLists {
  Buffer<dxGeom*> active;
  Buffer<PlacePair> pairs;
  Buffer<Group<dReal>> boxes;

  // For all pairs of so many geoms. False without memory for it.
  bool makeRoom(std::size_t geoms) { return geoms <= active.size() || grow(geoms); }
  std::size_t bytes() const { return bytesOf(active, pairs, boxes); }

 private:
  bool grow(std::size_t geoms);
};

// The geoms of such a scene that take part, and what was found among them.
struct SmallFound {
  dxGeom* const* active = nullptr;
  const PlacePair* pairs = nullptr;  // of places in `active`
  unsigned actives = 0;
  FrameCounts counts = {};
  bool user_classes = false;
  bool recalled = false;  // what was found is what was remembered
};

// What is done with the pairs of a small scene.
struct SmallReport {
  const PairReceiver& receiver;
  PairEvents* events;    // updated with the pairs; may be 0
  PairWatcher* watcher;  // sees the pairs; may be 0
};

// The same promises as the pipeline's without boxes, lists or clocks: for so few geoms those would
// take most of the time. Once nothing has moved for two frames the candidates are remembered: they
// stay while no geom is dirty, and all are as they were in what ODE does not announce.
class SmallScenes {
 public:
  // A geom became dirty, came or went.
  void noteChange() { is_still_ = false; }
  // `lists` have room, and no other frame uses them.
  FrameCounts collide(const Scene& scene, const PackRules& rules, SmallLists& lists,
                      Complaints& complaints, Statistics& statistics, const SmallReport& report);
  std::size_t bytes() const { return bytesOf(seen_, active_, pairs_, event_pairs_); }

 private:
  // What decides a geom's pairs while it does not move. That a sub-space is or is not empty any
  // more makes it dirty.
  struct Seen {
    using Difference = std::uintptr_t;
    static constexpr int flags_seen = GEOM_DIRTY | GEOM_ENABLE_TEST_MASK;

    const dxGeom* geom;
    const dxBody* body;
    unsigned long category, collide;
    int flags;

    explicit Seen(const dxGeom* seen)
        : geom(seen),
          body(seen->body),
          category(seen->category_bits),
          collide(seen->collide_bits),
          flags(seen->gflags & flags_seen) {}
    // 0 if it is as it was.
    Difference difference() const {
      const auto bits = [](const void* pointer) { return reinterpret_cast<Difference>(pointer); };
      return (bits(geom->body) ^ bits(body)) | (geom->category_bits ^ category) |
             (geom->collide_bits ^ collide) |
             static_cast<unsigned>((geom->gflags & flags_seen) ^ flags);
    }
  };

  bool isStill(const PackRules& rules) const;
  void noteFound(const Scene& scene, const PackRules& rules, Complaints& complaints,
                 const SmallFound& found);
  void remember(const Scene& scene, const PackRules& rules, const SmallFound& found);
  bool updateEvents(const Scene& scene, const SmallFound& found, PairEvents& events);

  bool is_still_ = false;      // it was remembered, and noteChange() was not called since
  unsigned still_frames_ = 0;  // without a move, in a row
  // What is remembered.
  PackRules rules_;
  std::vector<Seen> seen_;
  std::vector<dxGeom*> active_;
  std::vector<PlacePair> pairs_;
  SmallFound found_;  // in these

  PairList event_pairs_;  // by slot
};

}  // namespace ode_parallel_sap
